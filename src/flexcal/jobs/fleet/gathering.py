"""Estimates, verifications and visits of all robots of a fleet, gathered in one table."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.comparison import temperature_of
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, read_estimates, sha256_of
from flexcal.files.transaction import LARGEST
from flexcal.jobs.fleet.batches import Batches, batches_of
from flexcal.jobs.fleet.geometry_drifts import GeometryCourse, geometry_courses
from flexcal.jobs.fleet.members import Twin, latest_members, twins_of
from flexcal.jobs.fleet.parameter_owners import is_of_robot
from flexcal.jobs.fleet.places import local_fleet
from flexcal.jobs.fleet.projects import Problem, Project, ResultFolder, find_results, problem_of
from flexcal.jobs.fleet.result_values import ResultValue, result_values, visit_values
from flexcal.jobs.fleet.table import FleetTable, Row
from flexcal.jobs.recheck import VISITS, read_visits
from flexcal.jobs.result_files import DESCRIPTIONS, RESULTS, read_results
from flexcal.progress import Progress, silent

_DIGITS = 12
"""Number of hexadecimal digits of a SHA-256 that tell files apart in the table."""


@dataclass(frozen=True, eq=False)
class GatheredFleet:
    """The table of a fleet, its `projects`, its `problems`, and `repeated`: how many results stand in several folders; `courses` of the
    geometry of robots that were calibrated several times, `untested`: why others have none; `copied`: robots whose folders have results
    of another, by that one; `twins` probably are another robot of the fleet, measured anew; `batches` are models of which
    the robots are of two groups.
    """

    table: FleetTable
    projects: Sequence[Project]
    problems: Sequence[Problem]
    repeated: int
    courses: Sequence[GeometryCourse]
    untested: Mapping[str, str]
    copied: Mapping[str, str]
    twins: Sequence[Twin]
    batches: Sequence[Batches]


@dataclass(frozen=True, eq=False)
class _Result:
    """Rows of one result."""

    rows: Sequence[Row]

    @classmethod
    def of(cls, common: Row, values: Sequence[ResultValue]) -> _Result:
        """Result of these values; `common` is what all its rows have in common."""
        return cls(
            [
                replace(
                    common, name=item.name, value=item.value, std=item.std, unit=item.unit, text=item.text
                )
                for item in values
            ]
        )

    @property
    def identity(self) -> str:
        """Digest of its values and of what they were made from, wherever they stand."""
        first = self.first
        content = [first.kind, first.data, first.calibration, *((r.name, r.value, r.std) for r in self.rows)]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()

    @property
    def first(self) -> Row:
        """The first row."""
        return self.rows[0]


def gather_fleet(place: str | Path, progress: Progress = silent) -> GatheredFleet:
    """Gather the results of all projects in a folder, or at an address that fsspec reads.

    Parameters
    ----------
    place : str or Path
        The folder, or an address such as ``s3://bucket/robots``.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    GatheredFleet
        What cannot be read is among its `problems`.

    Raises
    ------
    InputError
        Where there is no such folder, or the address cannot be read.
    """
    with local_fleet(str(place)) as root:
        folders, projects, problems = find_results(root)
        problems = list(problems)
        results: list[_Result] = []
        for number, folder in enumerate(folders):
            progress("reading", number / len(folders))
            results += _results(root, folder, problems)
        progress("reading", 1.0)
        kept, repeated, copied = _distinct(results, problems)
        courses, refused, untested = geometry_courses(
            root, [result.first for result in kept], projects, progress
        )
        calibrated = latest_members(folders, ("calibration",))[0]["calibration"]
        twins = twins_of(calibrated)
        batches = batches_of(calibrated, twins)
    table = FleetTable.of(row for result in kept for row in result.rows)
    return GatheredFleet(
        table, projects, [*problems, *refused], repeated, courses, untested, copied, twins, batches
    )


def _results(root: Path, folder: ResultFolder, problems: list[Problem]) -> Iterator[_Result]:
    at, project = folder.folder, folder.project
    refuted = folder.refuted and folder.estimates.is_file()
    if refuted:
        problems.append(
            Problem(
                folder.estimates.relative_to(root).as_posix(),
                "the measurements of this calibration do not go together with its robot, so its parameters count in no trend, spread or "
                "prior; correct what its report names, and calibrate again.",
            )
        )
    for path, read in ((folder.estimates, _estimates), (at / RESULTS, _values), (at / VISITS, _visits)):
        if not path.is_file():
            continue
        try:
            for result in read(_row(root, folder, path), project, path):
                if not (refuted and path == folder.estimates and result.first.kind == "calibration"):
                    yield result
        except FlexcalError as problem:
            problems.append(problem_of(root, path, problem))
        except (KeyError, TypeError, ValueError, AttributeError) as problem:
            problems.append(
                Problem(
                    path.relative_to(root).as_posix(),
                    f"it has not the entries that the verb writes ({type(problem).__name__}: {problem}); run the verb again.",
                )
            )


def _row(root: Path, folder: ResultFolder, path: Path) -> Row:
    """What all rows from a file have in common."""
    project = folder.project
    return Row(
        robot=project.robot,
        serial=project.serial,
        model=project.model,
        urdf=project.urdf,
        tolerance=project.tolerance,
        folder=folder.folder.relative_to(root).as_posix(),
        date=folder.date,
        modified=datetime.fromtimestamp(path.stat().st_mtime).replace(microsecond=0),
        kind="",
        name="",
        value=None,
        std=None,
        unit="",
        text=None,
        identifiable=True,
        prior_share=None,
        of_robot=None,
        absorbs="",
        terms="",
        data="",
        calibration=None,
        independent=None,
        temperature=None,
        file=path.relative_to(root).as_posix(),
        sha256=sha256_of(path, limit=LARGEST),
    )


def _estimates(common: Row, project: Project, path: Path) -> Iterator[_Result]:
    for block, estimate in read_estimates(path).items():
        yield _block(common, project, block, estimate)


def _block(common: Row, project: Project, block: Block, estimate: Estimate) -> _Result:
    absorbed = estimate.absorbed
    held = {dropped.name for dropped in estimate.dropped}
    common = replace(
        common,
        kind=block,
        urdf=_digest_of_urdf(estimate.provenance) or common.urdf,
        terms=estimate.provenance.get("option.terms", ""),
        data=_data(estimate.provenance),
        temperature=temperature_of(estimate) if block == "calibration" else None,
    )
    parameters = estimate.parameters
    deviation = np.sqrt(np.diag(estimate.covariance))
    std = parameters.natural_slope(parameters.coordinates()) * deviation
    rows = []
    for k, item in enumerate(parameters):
        known = item.name not in held
        rows.append(
            replace(
                common,
                name=item.name,
                value=float(item.value) if known else None,
                std=float(std[k]) if known and estimate.identifiable[k] else None,
                unit=item.unit,
                identifiable=known and estimate.identifiable[k],
                prior_share=min(1.0, float(deviation[k] / item.prior_std) ** 2) if known else None,
                of_robot=is_of_robot(item.name, absorbed.get(item.name, ()), project.base),
                absorbs=" ".join(absorbed.get(item.name, ())),
            )
        )
    return _Result(rows)


def _values(common: Row, project: Project, path: Path) -> Iterator[_Result]:
    document = read_results(path.parent)
    values = result_values(document)
    if not values:
        return
    origin = document.get("provenance") or {}
    fitted = document.get("fitted")
    common = replace(
        common,
        kind=document["kind"],
        urdf=_digest_of_urdf(origin) or common.urdf,
        data=_data(origin),
        calibration=origin.get("block.calibration"),
        independent=None if fitted is None else not fitted,
        temperature=None
        if (warm := document.get("temperature")) is None
        else (warm["lowest"] + warm["highest"]) / 2,
    )
    yield _Result.of(common, values)


def _visits(common: Row, project: Project, path: Path) -> Iterator[_Result]:
    for visit in read_visits(path.parent, project.model):
        row = replace(
            common,
            kind="recheck",
            date=datetime.fromisoformat(visit.date),
            data=" ".join(sorted(digest[:_DIGITS] for digest in visit.files.values())),
            calibration=visit.calibration,
        )
        yield _Result.of(row, visit_values(visit))


def _digest_of_urdf(origin: Mapping[str, str]) -> str | None:
    return next(
        (v for k, v in origin.items() if k.startswith("input.") and k.endswith((".urdf", ".xml"))), None
    )


def _data(origin: Mapping[str, Any]) -> str:
    """First digits of the SHA-256 of the files of measurements that a result was made from."""
    return " ".join(
        sorted(
            str(digest)[:_DIGITS]
            for name, digest in origin.items()
            if name.startswith("input.") and not name.endswith(DESCRIPTIONS)
        )
    )


def _distinct(
    results: Sequence[_Result], problems: list[Problem]
) -> tuple[list[_Result], int, dict[str, str]]:
    """Every result once, of those that stand in several folders of a robot the one with the earliest date; one that stands in folders of
    several robots is a problem, and counts for the first of them.
    """
    kept: dict[str, _Result] = {}
    repeated = 0
    copies: dict[tuple[str, str], list[tuple[Row, Row]]] = {}
    for result in results:
        identity = result.identity
        other = kept.get(identity)
        if other is None:
            kept[identity] = result
        elif other.first.robot != result.first.robot:
            pair = result.first.robot, other.first.robot
            copies.setdefault(pair, []).append((result.first, other.first))
        else:
            repeated += 1
            if (result.first.date or datetime.max) < (other.first.date or datetime.max):
                kept[identity] = result
    for (robot, owner), pairs in copies.items():
        (copy, original), more = pairs[0], len(pairs) - 1
        also = f", and so {'is 1 more result' if more == 1 else f'are {more} more results'}" if more else ""
        problems.append(
            Problem(
                copy.file,
                f"the {copy.kind} is the same as in {original.file} of the robot {owner}{also}, so it is no result of {robot} and "
                "is not counted; measure this robot, or give both one `serial:`.",
            )
        )
    return list(kept.values()), repeated, {robot: owner for robot, owner in copies}
