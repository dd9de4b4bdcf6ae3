"""Recheck of the robot of a robot.yaml by files of measured poses, with the visits before."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from itertools import takewhile
from pathlib import Path

from flexcal.calibration.recheck import ShiftAtVisit, drift_sums
from flexcal.data.poses import DEFAULT_SIGMA, read_poses, tables_of
from flexcal.errors import InputError
from flexcal.files.formats import block_sha256, provenance, sha256_of
from flexcal.files.transaction import real_path
from flexcal.jobs.inputs import CalibratedRobot, image_provenance, outdated_remarks, require_distinct_files
from flexcal.jobs.recheck.one_visit import recheck, without_implausible_temperatures
from flexcal.jobs.recheck.result import Recheck
from flexcal.jobs.recheck.visit_course import CourseOverVisits
from flexcal.jobs.recheck.visit_history import (
    Readings,
    Visit,
    read_visits,
    same_visit,
    with_visit,
    write_visits,
)
from flexcal.jobs.result_files import RunRecord
from flexcal.progress import Progress, silent

_LARGEST = 5e-3
"""Standard deviation of a shift above which it is no information for cumulative sums, rad or m."""


def recheck_robot(
    robot_file: Path,
    files: Sequence[Path],
    out: Path,
    *,
    estimates: Path | None = None,
    refit: bool = False,
    reference: bool = False,
    temperature: float | None = None,
    day: str | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Recheck:
    """`recheck` of the robot of a robot.yaml, against the reference visit among those stored in the folder `out`, to which this is added.

    Without a reference visit the first that is as calibrated becomes it; with `reference` this one does. `day` is the date of the visit,
    ISO 8601, by default today. results.json and report.html are left in `out` too. Raises `FlexcalError` as reading and `recheck` do, and
    `InputError` for a date that is none.
    """
    when = _date(day)
    files = tables_of(files)
    require_distinct_files(files)
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    assert robot.stored is not None
    progress("reading", 0.0)
    poses = without_implausible_temperatures(
        robot, read_poses(list(files), robot.model, require_motion=False)
    )
    progress("reading", 1.0)
    calibration = block_sha256(robot.stored, "calibration")
    digests = {f"{k}. {file.name}": sha256_of(file) for k, file in enumerate(files, start=1)}
    stored = read_visits(out, robot.nominal.name)
    readings = Readings.of(poses)
    # visits compared with another calibration, as before the last one, are kept and do not count
    comparable = [v for v in stored if v.calibration == calibration]
    same = next((v for v in comparable if same_visit(v.readings, readings)), None)
    renamed = same is not None and sorted(same.files.values()) != sorted(digests.values())
    renamed = renamed or (same is not None and sorted(same.files) != sorted(digests))
    again = same.date if same is not None and (renamed or (day is not None and same.date != when)) else None
    when = when if same is None else same.date
    before = [v for v in comparable if v is not same and v.date <= when]
    references = [k for k, v in enumerate(before) if v.reference]
    base = before[references[-1]] if references else None
    before = before[references[-1] :] if references else before
    judged = recheck(
        robot,
        poses,
        reference=None if base is None else base.readings.poses(DEFAULT_SIGMA),
        refit=refit,
        temperature=temperature,
    )
    absolute = judged.absolute or judged.judged
    later = [v for v in comparable if v is not same and v.date > when]
    first = base is None and absolute.verdict == "as_calibrated" and not any(v.reference for v in later)
    becomes = reference or first or (same is not None and same.reference)
    origin = provenance([robot_file, robot.nominal.urdf, *files], None, robot.stored, tuple(robot.blocks))
    if base is not None:
        origin |= {f"input.{name} (reference visit)": digest for name, digest in base.files.items()}
    judged = replace(
        judged,
        reference_date=base.date if base is not None and judged.absolute is not None else None,
        becomes_reference=becomes,
        again=again,
        repeated=_repeated(readings, before),
        succeeded=any(v.reference for v in later),
        order=(*outdated_remarks(robot), *_order(when, robot.stored, later, becomes)),
        record=RunRecord(origin | image_provenance(files), command),
    )
    series = _series(judged, base, calibration)
    shifts = [item for item in judged.judged.at_visit(series) if item.std < _LARGEST]
    history = [*before, _visit(judged, when, digests, calibration, shifts)]
    errors = judged.judged.test.errors
    judged = replace(
        judged,
        kept=len(comparable) + (same is None),
        dates=tuple(v.date for v in history),
        drifts=drift_sums([v.shifts if v.steady else [] for v in history]),
        course=CourseOverVisits.of(robot.model, errors, when, before, base),
    )
    visit = replace(
        history[-1],
        reference=becomes,
        alarms=list(judged.alarms),
        sentence=judged.headline,
    )
    progress("writing", 0.5)
    judged.write(out)
    write_visits(out, robot.nominal.name, with_visit(stored, visit))
    progress("writing", 1.0)
    return judged


def _visit(
    judged: Recheck,
    when: str,
    digests: dict[str, str],
    calibration: str,
    shifts: list[ShiftAtVisit],
) -> Visit:
    """The visit as it is stored, before its cumulative sums are known."""
    return Visit(
        date=when,
        files=digests,
        calibration=calibration,
        reference=False,
        verdict=judged.verdict,
        sentence=judged.headline,
        probability=judged.probability,
        shifts=shifts,
        readings=Readings.of(judged.poses),
        alarms=[],
        suspects=judged.numbers["suspects"],
        placed=judged.judged.test.errors.placed,
    )


def _repeated(readings: Readings, before: Sequence[Visit]) -> str | None:
    """That some of the readings are of a visit before, in words; None where all are new."""
    shared = [(readings.shared(visit.readings), visit.date) for visit in before]
    most, when = max(shared, default=(0, ""))
    if not most:
        return None
    of = f"of the {len(readings.pose)} readings"
    said = f"to the last digit: {'it tells' if most == 1 else 'they tell'} nothing new, and the test takes"
    if most == 1:
        return f"one {of} is that of the visit of {when}, {said} it for a new one; give a file with this visit alone"
    return f"{most} {of} are those of the visit of {when}, {said} them for new ones; give a file with this visit alone"


def _order(when: str, stored: Path, later: Sequence[Visit], becomes: bool) -> tuple[str, ...]:
    """What is to be said of a visit that is dated before others, before the calibration, or in the future."""
    told = []
    made = _date_of_folder(stored)
    if made is not None and when < made:
        told.append(
            f"the visit is dated {when}, before the calibration of {made} that judges it; give its day by --date if that is wrong"
        )
    if when > date.today().isoformat():
        told.append(f"the visit is dated {when}, in the future; give its day by --date if that is wrong")
    references = [v.date for v in later if v.reference]
    if references:
        until = f"visits before that of {references[0]}, which stays the reference of those after it"
        told.append(
            f"this visit is the reference of {until}"
            if becomes
            else f"the visit is dated before the reference visit of {references[0]}, which stays the reference of those after it"
        )
    # a later reference, and what is compared with it, do not depend on this visit
    concerned = list(takewhile(lambda v: not v.reference, later))
    if concerned:
        days = " and ".join(dict.fromkeys(v.date for v in concerned))
        told.append(
            f"what visits.json says of {days} was judged without this visit; recheck those files again, in the order of their dates (a "
            "visit keeps its date)"
        )
    return tuple(told)


def _date_of_folder(stored: Path) -> str | None:
    """Date of a calibration, from the name of its folder; None where that is none."""
    try:
        return date.fromisoformat(real_path(stored).parent.name[:10]).isoformat()
    except ValueError:
        return None


def _series(judged: Recheck, base: Visit | None, calibration: str) -> str:
    """Name of what visits share that are compared with the same thing at the same poses."""
    errors = judged.judged.test.errors
    against = calibration if errors.compared == "calibration" or base is None else json.dumps(base.files)
    poses = sorted(
        f"{target} {q}"
        for target, q in zip(errors.poses.target.tolist(), errors.poses.q.round(3).tolist(), strict=True)
    )
    told = json.dumps([errors.compared, against, errors.placed, poses])
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def _date(day: str | None) -> str:
    if day is None:
        return date.today().isoformat()
    try:
        return date.fromisoformat(day).isoformat()
    except ValueError:
        raise InputError("E-RECHECK-009", f"--date {day} is no date; write it like 2026-03-31.") from None
