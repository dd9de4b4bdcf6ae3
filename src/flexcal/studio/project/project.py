"""The folder of a calibration: the same files that the command line reads and writes."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import real_path

ROBOT = "robot.yaml"
PLAN = "poses.yaml"
"""Plan of the poses to calibrate on."""
MEASURED = "poses.csv"
"""Measured poses of a guided session."""
CHECK_PLAN = "others.yaml"
"""Plan of the poses to verify on."""
CHECKED = "others.csv"
CALIBRATION = "calibration"
VERIFICATION = "verification"
MAP = "map"
_DEPTH = 3
"""Folders below the project's in which files are offered."""
_MANY = 2000
"""Files that are looked at, at most."""
_STAMPED = (
    ".yaml",
    ".yml",
    ".csv",
    ".parquet",
    ".json",
    ".urdf",
    ".npz",
    ".stl",
    ".obj",
    ".dae",
    ".STL",
    ".OBJ",
    ".DAE",
)
_HIDDEN = (".", "__pycache__", "node_modules")


@dataclass(frozen=True)
class Project:
    """The folder of a calibration.

    Parameters
    ----------
    folder : Path
        An existing folder, absolute.
    """

    folder: Path

    @classmethod
    def open(cls, folder: Path) -> Project:
        """Project of a folder; raises `InputError` where there is none."""
        if not folder.is_dir():
            raise InputError(
                "E-STUDIO-040", f"{folder} is no folder; make it, or give that of the robot's files."
            )
        return cls(real_path(folder))

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name or str(self.folder)

    @property
    def robot_file(self) -> Path:
        """File that describes the robot and its cell, whether it is there or not."""
        return self.folder / ROBOT

    def told(self, sentence: str) -> str:
        """A sentence with the names of the project's files relative to its folder."""
        return sentence.replace(f"{self.folder}{os.sep}", "")

    def path(self, name: str) -> Path:
        """Path of a file or folder by its name relative to the project; it need not exist.

        Raises
        ------
        InputError
            Where it lies outside the project, links followed, or is no name of a file.
        """
        outside = InputError(
            "E-STUDIO-041", f"'{name}' is not in the folder {self.name}; give the name of a file there."
        )
        if not name.strip() or "\0" in name or Path(name).is_absolute():
            raise outside
        try:
            place = real_path(self.folder / name)
        except (OSError, RuntimeError) as problem:
            raise outside from problem
        if not place.is_relative_to(self.folder) or place == self.folder:
            raise outside
        return self.folder / os.path.normpath(name)

    def files(self, *endings: str) -> list[str]:
        """Names of the project's files with one of these endings (as '.csv'), sorted.

        Hidden ones are left out, and what is no file of its own, such as links and pipes.
        """
        found: list[str] = []
        seen = 0
        for place, folders, names in os.walk(self.folder):
            depth = len(Path(place).relative_to(self.folder).parts)
            folders[:] = [f for f in sorted(folders) if not f.startswith(_HIDDEN)] if depth < _DEPTH else []
            for name in sorted(names):
                seen += 1
                path = Path(place, name)
                if name.endswith(endings) and not name.startswith(".") and _is_regular(path):
                    found.append(path.relative_to(self.folder).as_posix())
            if seen > _MANY:
                break
        return found

    def results(self, kind: str | None = None) -> list[str]:
        """Names of the folders with a results.json, newest last; of one kind (as 'calibration') where it is given."""
        from flexcal.jobs.result_files import RESULTS

        folders = []
        for name in self.files(RESULTS):
            folder = Path(name).parent
            if folder == Path(".") or Path(name).name != RESULTS:
                continue
            if kind is None or _kind(self.folder / folder) == kind:
                folders.append(folder.as_posix())
        return sorted(folders, key=lambda name: (self.folder / name / RESULTS).stat().st_mtime_ns)

    def stamp(self) -> tuple[tuple[str, int, int], ...]:
        """Name, time of change (ns) and size of each file that a step may show; equal stamps mean that nothing changed."""
        stamps = []
        for name in self.files(*_STAMPED):
            try:
                status = (self.folder / name).stat()
            except OSError:  # it has just been removed
                continue
            stamps.append((name, status.st_mtime_ns, status.st_size))
        return tuple(stamps)


def _is_regular(path: Path) -> bool:
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:  # it has just been removed
        return False


def _kind(folder: Path) -> str | None:
    from flexcal.jobs.result_files import read_results

    try:
        return read_results(folder).get("kind")
    except InputError:
        return None
