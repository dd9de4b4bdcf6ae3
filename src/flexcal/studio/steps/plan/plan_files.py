"""Plans in the folder."""

from __future__ import annotations

from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import open_regular
from flexcal.studio.project import ROBOT, Project, read_plan_file

_HEAD = 200_000
"""Bytes of a file in which its kind is looked for."""


def plan_files(project: Project, kind: str) -> list[str]:
    """Names of the plans of one kind ('poses', 'trajectory', 'multisine'), those beside robot.yaml first."""
    names = [
        name
        for name in project.files(".yaml")
        if name != ROBOT
        and _says(project.folder / name, kind)
        and read_plan_file(project.folder / name) is not None
    ]
    return sorted(names, key=lambda name: (name.count("/"), name))


def _says(path: Path, kind: str) -> bool:
    """Whether a line of the file says that it is of this kind, which most files of a folder do not."""
    try:
        with open_regular(path, limit=None) as stream:
            head = stream.read(_HEAD)
    except (InputError, OSError):
        return False
    return any(line.strip() == f"kind: {kind}".encode() for line in head.splitlines())
