"""Robots to try the studio with."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import atomic_paths
from flexcal.studio.project import Project

_EXAMPLES = {
    "ur5_tracker": "UR5, measured with a laser tracker",
    "tx90l": "Stäubli TX90L, to be measured in the virtual cell",
}
_LEFT_OUT = (".py", ".pyc")


@dataclass(frozen=True)
class Example:
    """An example that is on this machine: its title and the folder of its files."""

    title: str
    folder: Path

    def files(self) -> list[Path]:
        """Its files, without programs."""
        return sorted(
            path for path in self.folder.iterdir() if path.is_file() and path.suffix not in _LEFT_OUT
        )

    def copy_to(self, project: Project) -> list[str]:
        """Copy its files into a project, all or none, and return their names; raises `InputError` where one is there already."""
        files = self.files()
        there = [path.name for path in files if (project.folder / path.name).exists()]
        if there:
            raise InputError(
                "E-STUDIO-027",
                f"the folder {project.name} has {', '.join(there)} already, which an example does not overwrite; open an empty folder.",
            )
        with atomic_paths(*(project.folder / path.name for path in files)) as places:
            for path, place in zip(files, places, strict=True):
                shutil.copyfile(path, place)
        return [path.name for path in files]


def examples_here() -> list[Example]:
    """The examples that are on this machine: flexcal's checkout has them, an installed package has none."""
    from flexcal.jobs.inputs import example_robot

    found = []
    for name, title in _EXAMPLES.items():
        try:
            found.append(Example(title, example_robot(name).absolute().parent))
        except InputError:
            continue
    return found
