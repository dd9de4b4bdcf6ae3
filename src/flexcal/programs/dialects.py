"""The dialects of robot programs, by the suffixes of their files."""

from __future__ import annotations

from pathlib import Path

from flexcal.errors import InputError
from flexcal.programs.dialect import Dialect
from flexcal.programs.fanuc import FANUC
from flexcal.programs.krl import KRL
from flexcal.programs.rapid import RAPID
from flexcal.programs.urscript import URSCRIPT

DIALECTS: tuple[Dialect, ...] = (FANUC, KRL, RAPID, URSCRIPT)
"""Dialects that are read."""


def dialect_of(file: Path) -> Dialect:
    """Dialect of a program's file by its suffix; raises `InputError` for a suffix of none."""
    for dialect in DIALECTS:
        if file.suffix.lower() in dialect.suffixes:
            return dialect
    known = "; ".join(f"{dialect.name} ({', '.join(dialect.suffixes)})" for dialect in DIALECTS)
    raise InputError("E-PROG-004", f"{file} is no robot program by its suffix; those that are read: {known}.")
