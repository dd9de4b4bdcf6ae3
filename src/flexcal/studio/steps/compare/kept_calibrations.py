"""The calibrations that are in a project."""

from __future__ import annotations

import shutil
import tempfile
from datetime import date
from pathlib import Path

from flexcal.errors import InputError
from flexcal.studio.project import CALIBRATION, Project


def calibrations(project: Project) -> list[str]:
    """Names of the folders with a calibration, the earliest first."""
    return project.results("calibration")


def keep_calibration(project: Project) -> str:
    """Copy the calibration to a folder with today's date, and return its name.

    Raises `InputError` where there is none, or the folder cannot be written.
    """
    source = project.path(CALIBRATION)
    if not source.is_dir():
        raise InputError(
            "E-STUDIO-019", f"there is no folder {CALIBRATION} to copy; calibrate first (step 4)."
        )
    name = day = f"{CALIBRATION}-{date.today().isoformat()}"
    number = 2
    while (project.folder / name).exists():
        name, number = f"{day}-{number}", number + 1
    with tempfile.TemporaryDirectory(prefix=".keep-", dir=project.folder) as place:
        copy = Path(place, name)
        shutil.copytree(source, copy, symlinks=True)
        copy.rename(project.folder / name)
    return name
