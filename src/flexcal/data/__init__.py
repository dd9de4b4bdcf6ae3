"""Measured poses, joint logs, experiment plans and their files."""
