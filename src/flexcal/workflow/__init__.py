"""Complete jobs composed of the stages, one module per job; the only package that reads the truth file."""
