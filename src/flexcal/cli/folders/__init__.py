"""Folders of arguments and of `--out`: protection of existing files, the ledger of what was written, and interrupted runs."""
