"""Tables of the project that may be measured poses."""

from __future__ import annotations

import re
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import open_regular, read_text
from flexcal.studio.project.project import MEASURED, Project

_HEADER = 4096
"""Bytes of a file in which its header is looked for."""


def pose_files(project: Project) -> list[str]:
    """Names of tables that may be measured poses: a guided session's first, then by size.

    These are tables with joint and measured columns; all tables where robot.yaml declares columns of its own. Those within folders of
    results are left out.
    """
    own = _declares_columns(project)
    names = [
        name
        for name in project.files(".csv", ".parquet")
        if not is_result(project, name) and (own or _has_readings(project.folder / name))
    ]
    return sorted(names, key=lambda name: (name != MEASURED, -(project.folder / name).stat().st_size))


def _declares_columns(project: Project) -> bool:
    try:
        return "\nsignals:" in read_text(project.robot_file, errors="replace")
    except (InputError, OSError):
        return False


def is_result(project: Project, name: str) -> bool:
    """Whether a file is in a folder of results."""
    return (project.folder / name).with_name("results.json").is_file() and "/" in name


def _has_readings(path: Path) -> bool:
    """Whether the header has joint positions and a reading of an instrument."""
    if path.suffix == ".parquet":
        return True
    try:
        with open_regular(path, limit=None) as stream:
            head = stream.read(_HEADER).decode("utf-8", "replace").splitlines()
    except (InputError, OSError):
        return False
    columns = {cell.strip().strip('"') for cell in head[0].split(",")} if head else set()
    return (
        "q1" in columns and not columns & COMPUTED and any(not _PLANNED.fullmatch(name) for name in columns)
    )


COMPUTED = {"p95_mm", "unambiguous"}
"""Columns of accuracy maps and of commands."""
_PLANNED = re.compile(r"q\d+|pose|payload|plan|set|name|seed")
"""Columns that a table of planned poses has too."""
