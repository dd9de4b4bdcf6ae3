"""Project folders of a fleet, the robots that they are of, and the folders with results in them."""

from __future__ import annotations

import os
import re
from collections.abc import Container, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.files.formats import read_yaml, sha256_of
from flexcal.files.transaction import real_path
from flexcal.jobs.fleet.places import ROBOT
from flexcal.jobs.recheck import VISITS
from flexcal.jobs.result_files import ESTIMATES, RESULTS, read_results
from flexcal.model.robot import RobotConfig
from flexcal.model.urdf import Element, read_elements

_DATE = re.compile(
    r"(?<!\d)(?:(?P<year>\d{4})(?P<between>[-_.])(?P<month>\d\d)(?P=between)(?P<day>\d\d)|(?P<d>\d\d)\.(?P<m>\d\d)\.(?P<y>\d{4}))"
    r"(?:[T_ ](?P<hour>\d\d)[-:.]?(?P<minute>\d\d)(?!\d))?(?!\d)"
)
"""Year, month and day with hyphens, underscores or dots between them, or day, month and year with dots."""


@dataclass(frozen=True)
class Problem:
    """A file or folder that cannot be used: its path relative to the fleet's folder, and one sentence that says why."""

    place: str
    sentence: str


@dataclass(frozen=True)
class Project:
    """A folder with a robot.yaml. `place` is its path from the fleet's folder without dates, and `robot` its serial, or without one the
    place; `model` the name in the URDF and `urdf` the SHA-256 of that; `base` are the joints that are on the base.
    """

    folder: Path
    place: str
    robot: str
    serial: str | None
    model: str
    urdf: str
    tolerance: float | None
    estimates: Path
    base: frozenset[str]


@dataclass(frozen=True)
class ResultFolder:
    """A folder with results of a project; `date` from the name of the nearest folder that has one in it, None where none has."""

    project: Project
    folder: Path
    date: datetime | None

    @property
    def estimates(self) -> Path:
        """Its file of estimates, whether it is there or not; beside robot.yaml the one that this names."""
        return self.project.estimates if self.folder == self.project.folder else self.folder / ESTIMATES

    @property
    def refuted(self) -> bool:
        """Whether it has a calibration that its own measurements refute: by robot and data that do not go together, or by points of a robot
        that moved.
        """
        if not (self.folder / RESULTS).is_file():
            return False
        try:
            document = read_results(self.folder)
            fit, lag = document.get("fit"), document.get("lag") or {}
            return document["kind"] == "calibration" and bool(
                (fit or {}).get("is_implausible") or lag.get("certain")
            )
        except (FlexcalError, AttributeError):
            return False


def find_results(root: Path) -> tuple[list[ResultFolder], list[Project], list[Problem]]:
    """Folders with results below `root`, their projects and the problems, in the order of their paths.

    Results belong to the nearest robot.yaml in their folder or above it. Hidden folders, and folders behind links, are not looked into.
    """
    results: list[ResultFolder] = []
    projects: dict[Path, Project | None] = {}
    problems: list[Problem] = []
    for folder, files in _folders(root, problems):
        if ROBOT in files:
            try:
                projects[folder] = _project(root, folder)
            except FlexcalError as problem:
                projects[folder] = None
                problems.append(problem_of(root, folder / ROBOT, problem))
        owner = next((at for at in (folder, *folder.parents) if at in projects), None)
        project = None if owner is None else projects[owner]
        own = None if project is None or project.folder != folder else project.estimates
        if not {ESTIMATES, RESULTS, VISITS} & set(files) and not (own is not None and own.is_file()):
            continue
        if owner is None:
            problems.append(
                Problem(
                    _relative(root, folder),
                    f"results, but there is no {ROBOT} in this folder or above it; put it beside them.",
                )
            )
        if project is not None:
            date = date_of(_parts(root, folder))
            if date is not None and date > datetime.now() + timedelta(days=1):
                problems.append(
                    Problem(
                        _relative(root, folder),
                        f"the date {date:%Y-%m-%d} is in the future, so these results count as undated; correct the folder's name.",
                    )
                )
                date = None
            results.append(ResultFolder(project, folder, date))
    return results, [project for project in projects.values() if project is not None], problems


def date_of(parts: tuple[str, ...]) -> datetime | None:
    """Date, and time if there is one, in the last name that has one, as in `2026-03-01` or `2026-03-01T14-30_after_repair`; also
    `2026_03_01`, `2026.03.01` and `01.03.2026`.
    """
    for part in reversed(parts):
        match = _DATE.search(part)
        if match is not None:
            found = match.groupdict(default="")
            year, month, day = (
                found[long] or found[short] for long, short in (("year", "y"), ("month", "m"), ("day", "d"))
            )
            try:
                return datetime(
                    int(year), int(month), int(day), int(found["hour"] or 0), int(found["minute"] or 0)
                )
            except ValueError:
                continue
    return None


def problem_of(root: Path, place: Path, problem: Exception) -> Problem:
    """An error about a file as a row of the list of problems."""
    where = _relative(root, place)
    sentence = str(problem).replace(f"{root}{os.sep}", "")
    return Problem(where, sentence.removeprefix(f"{where} ").removeprefix(f"{where}: "))


def _folders(root: Path, problems: list[Problem]) -> Iterator[tuple[Path, list[str]]]:
    def refused(problem: OSError) -> None:
        place = Path(problem.filename or root)
        problems.append(
            Problem(
                _relative(root, place),
                f"the folder cannot be read ({problem.strerror}); check the rights to it.",
            )
        )

    for at, folders, files in os.walk(root, onerror=refused):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield Path(at), files


def _project(root: Path, folder: Path) -> Project:
    config = read_yaml(folder / ROBOT, RobotConfig)
    urdf = folder / config.robot
    description = read_elements(urdf)
    model = description.attributes.get("name") or urdf.stem
    names = [part for part in _parts(root, folder) if date_of((part,)) is None]
    place = "/".join(names) or real_path(root).name
    return Project(
        folder,
        place,
        config.serial or place,
        config.serial,
        model,
        sha256_of(urdf),
        config.tolerance,
        folder / config.estimates,
        _joints_on_base(description, config.locked),
    )


def _joints_on_base(description: Element, locked: Container[str]) -> frozenset[str]:
    """Names of the movable joints that no other movable joint carries."""
    joints = list(description.all("joint"))
    moved: set[str] = set()
    links: dict[str, Element] = {}
    for joint in joints:
        child = joint.find("child")
        if child is not None:
            links[child.attributes.get("link", "")] = joint
    for joint in joints:
        name = joint.attributes.get("name", "")
        if joint.attributes.get("type") != "fixed" and name not in locked:
            moved.add(name)
    first = set()
    for joint in joints:
        above, seen = joint, set()
        while (parent := above.find("parent")) is not None:
            carrier = links.get(parent.attributes.get("link", ""))
            if carrier is None or id(carrier) in seen:
                first.add(joint.attributes.get("name", ""))
                break
            if carrier.attributes.get("name") in moved:
                break
            seen.add(id(carrier))
            above = carrier
    return frozenset(first & moved)


def _parts(root: Path, folder: Path) -> tuple[str, ...]:
    return folder.relative_to(root).parts


def _relative(root: Path, place: Path) -> str:
    return place.relative_to(root).as_posix()
