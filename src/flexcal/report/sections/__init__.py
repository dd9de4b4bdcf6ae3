"""Sections of a report, one per file: functions from result objects to `Section`."""
