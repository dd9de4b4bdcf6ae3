"""Sections of a report, one a file: functions from result objects to `Section`."""
