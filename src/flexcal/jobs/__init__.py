"""Whole jobs of the command line, one package a family of verbs; the only package that reads the file of true parameters."""
