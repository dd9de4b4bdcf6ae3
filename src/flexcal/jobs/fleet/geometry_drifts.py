"""Drift of robots' geometry over their calibrations, all parameters tested together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from flexcal.calibration.comparison import Explanation, GeometryTrend
from flexcal.calibration.comparison import geometry_courses as courses_of
from flexcal.errors import FlexcalError
from flexcal.files.formats import read_estimates, sha256_of
from flexcal.fleet import FEWEST_VISITS, JointLine, JointTest, holm, joint_tests
from flexcal.jobs.fleet.courses import years
from flexcal.jobs.fleet.places import ROBOT
from flexcal.jobs.fleet.projects import Problem, Project, problem_of
from flexcal.jobs.fleet.table import Row
from flexcal.jobs.pages import model_before
from flexcal.jobs.result_files import RESULTS
from flexcal.progress import Progress

_OTHER_URDF = "the URDF is another than that of its calibrations, so they cannot be compared"


@dataclass(frozen=True, eq=False)
class GeometryCourse:
    """A robot's geometry over calibrations on `dates`: its `trend`, and its `steps` between each and the next. `places` are the folders of
    the robot, without dates, that the calibrations are in.
    """

    robot: str
    model: str
    urdf: str
    dates: tuple[datetime, ...]
    trend: GeometryTrend
    steps: tuple[GeometryTrend, ...]
    places: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class GeometryDrift:
    """Test of a course, its p-value corrected for the number of robots and of tests of each, and what explains the change where that is
    significant: `explanations` from the first to the last visit, by how far they move the tool, m: mean, its standard deviation, largest,
    and `by_load`: whether a load that was not declared explains it about as well.

    `step` is the number of the calibration, from 0, after which the robot jumped, where that explains its course better than the trend.
    """

    course: GeometryCourse
    step: int | None
    test: JointTest
    probability: float
    explanations: tuple[Explanation, ...]
    moved: tuple[float, float, float] | None
    by_load: bool = False

    @property
    def compared(self) -> tuple[int, int]:
        """Numbers of the first and the last calibration, or of those before and after a step."""
        return (0, len(self.course.dates) - 1) if self.step is None else (self.step, self.step + 1)

    @property
    def two_robots(self) -> tuple[str, str] | None:
        """Folders that may be of two robots with one serial number: the calibrations compared are of both, and no single change explains
        how they differ, nor a load.
        """
        if not self.course.places or len(self.explanations) == 1 or self.by_load:
            return None
        before, after = (self.course.places[k] for k in self.compared)
        return None if before == after else (before, after)


def geometry_courses(
    root: Path, results: Sequence[Row], projects: Sequence[Project], progress: Progress
) -> tuple[list[GeometryCourse], list[Problem], dict[str, str]]:
    """Courses of robots with three calibrations or more on different days; problems of those that cannot be compared, and why, by robot.

    `results` are the first rows of all results, each once. Of calibrations of one day, or from the same measurements, the last counts.
    """
    robots: dict[tuple[str, str, str], list[Row]] = defaultdict(list)
    for row in results:
        if row.kind == "calibration" and row.date is not None and Path(row.file).name != RESULTS:
            robots[row.robot, row.model, row.urdf].append(row)
    many = {key: visits for key, rows in robots.items() if len(visits := _visits(rows)) >= FEWEST_VISITS}
    courses: list[GeometryCourse] = []
    problems: list[Problem] = []
    untested: dict[str, str] = {}
    for number, ((robot, model, urdf), visits) in enumerate(many.items()):
        progress("comparing", number / len(many))
        dates = tuple(row.date for row in visits if row.date is not None)
        folder = next(p.folder for p in reversed(projects) if p.robot == robot)
        try:
            trend, *steps = _courses(root, folder, urdf, visits, dates) or (None,)
        except FlexcalError as problem:
            problems.append(problem_of(root, folder, problem))
            untested[robot] = problems[-1].sentence.rstrip(".")
            continue
        if trend is None:
            untested[robot] = _OTHER_URDF
        else:
            places = tuple(_place(root / row.file, projects) for row in visits)
            courses.append(GeometryCourse(robot, model, urdf, dates, trend, tuple(steps), places))
    return courses, problems, untested


def geometry_drifts(courses: Sequence[GeometryCourse], families: int, level: float) -> list[GeometryDrift]:
    """Of every course the test of its trend, or of the step between two calibrations that explains it better. All these share the error
    rate with those of all `families` of tests; the change is explained of those that are significant at the `level`.
    """
    tried = [(c, k, t) for c in courses for k, t in ((None, c.trend), *enumerate(c.steps))]
    lines = [
        JointLine(len(t.change), t.visits, t.statistic, t.residual, t.freedom, (c.model, c.urdf, k))
        for c, k, t in tried
    ]
    tests = joint_tests(lines)
    adjusted = holm([test.probability for test in tests])
    best: dict[tuple[str, str], tuple[GeometryTrend, GeometryDrift]] = {}
    for (course, step, along), test, corrected in zip(tried, tests, adjusted, strict=True):
        p = min(1.0, families * float(corrected))
        key = course.robot, course.urdf
        if key in best and best[key][1].test.probability <= test.probability:
            continue
        best[key] = along, GeometryDrift(course, step, test, p, (), None)
    found = []
    for along, drift in best.values():
        test = drift.test
        explanations = along.explained(test.scale, test.freedom) if drift.probability <= level else ()
        moved = along.displacement(explanations, test.scale)
        by_load = drift.probability <= level and along.is_load(explanations, test.scale, test.freedom)
        found.append(replace(drift, explanations=explanations, moved=moved, by_load=by_load))
    return found


def _place(file: Path, projects: Sequence[Project]) -> str:
    """Place of the project that a file is of."""
    return max((p for p in projects if p.folder in file.parents), key=lambda p: len(p.folder.parts)).place


def _visits(rows: Sequence[Row]) -> list[Row]:
    distinct = {row.data or row.file: row for row in sorted(rows, key=_when)}
    return list({row.date and row.date.date(): row for row in sorted(distinct.values(), key=_when)}.values())


def _when(row: Row) -> datetime:
    return row.date or row.modified


def _courses(
    root: Path, folder: Path, urdf: str, visits: Sequence[Row], dates: Sequence[datetime]
) -> tuple[GeometryTrend, ...]:
    estimates = [read_estimates(root / row.file)["calibration"] for row in visits]
    model, same = model_before(folder / ROBOT, estimates)
    if sha256_of(model.urdf) != urdf:
        return ()
    return courses_of(model, estimates, np.array([years(date) for date in dates]), same_springs=same)
