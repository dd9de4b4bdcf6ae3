"""Standard streams, progress, safe text, encoding and stop signals of the terminal."""
