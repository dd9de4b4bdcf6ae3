"""One module a verb: its arguments, the job that it runs, and what it prints."""
