"""Composes the stages into jobs: one module a job; alone opens the truth file."""
