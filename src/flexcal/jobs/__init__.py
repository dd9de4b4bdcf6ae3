"""Complete workflows of the command line, one package per family of verbs; the only package that reads the file of true parameters."""
