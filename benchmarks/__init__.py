"""Side-by-side measurements: each module's `run` returns (name, ratio, note); a ratio above one is in our favour."""
