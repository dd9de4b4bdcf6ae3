"""Tables of results for people, in degrees and millimetres."""
