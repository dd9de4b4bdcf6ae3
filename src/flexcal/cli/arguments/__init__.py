"""Command-line arguments: the table of verbs, shared options, errors in arguments, shell completion, and commands to suggest."""
