"""The file of all visits to a robot: visits.json."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.recheck import ShiftAtVisit
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import read_json
from flexcal.files.structuring import structure
from flexcal.files.transaction import current_path, write_text
from flexcal.jobs.result_files import json_text

AS_AT_REFERENCE = "as_at_reference"
"""Verdict where nothing changed since a reference visit that was not as calibrated itself."""
VISITS = "visits.json"
"""File of the visits, in the folder of `--out`."""
_SCHEMA = 1
_ADVICE = "restore it from a copy, or move it away to begin anew"


@dataclass(frozen=True)
class Readings:
    """Measured points of a visit, N rows: SI units, `sigma`, `payload` and `temperature` (°C) None where they were not given."""

    pose: list[int]
    target: list[str]
    station: list[str]
    q: list[list[float]]
    position: list[list[float]]
    sigma: list[list[float]] | None = None
    payload: list[float] | None = None
    temperature: list[float] | None = None

    def __post_init__(self) -> None:
        columns = (
            self.target,
            self.station,
            self.q,
            self.position,
            self.sigma,
            self.payload,
            self.temperature,
        )
        joints = {len(row) for row in self.q}
        triples = {len(row) for column in (self.position, self.sigma or []) for row in column}
        if (
            any(len(column) != len(self.pose) for column in columns if column is not None)
            or len(joints) > 1
            or triples - {3}
        ):
            raise FlexcalError("E-RECHECK-011", "the readings of a visit are not of one length.")

    @classmethod
    def of(cls, poses: PoseSet) -> Readings:
        """Readings of a pose set of points."""
        return cls(
            poses.pose.tolist(),
            poses.target.tolist(),
            poses.station.tolist(),
            poses.q.tolist(),
            poses.position.tolist(),
            poses.sigma.tolist() if poses.sigma_given else None,
            None if poses.payload is None else poses.payload.tolist(),
            None if poses.temperature is None else poses.temperature.tolist(),
        )

    def shared(self, other: Readings) -> int:
        """Number of rows that another visit has too: joint positions, point and coordinates equal to a nanometre."""
        return sum((Counter(self._rows) & Counter(other._rows)).values())

    @property
    def _rows(self) -> list[tuple[str, ...]]:
        return [
            (target, *(f"{value:.9f}" for value in (*q, *position)))
            for target, q, position in zip(self.target, self.q, self.position, strict=True)
        ]

    def poses(self, sigma: float) -> PoseSet:
        """The pose set; `sigma`, m, is that of each coordinate where none was given."""
        position = np.array(self.position, dtype=float).reshape(-1, 3)
        given = self.sigma is not None
        return PoseSet(
            q=np.array(self.q, dtype=float),
            position=position,
            sigma=np.array(self.sigma, dtype=float) if given else np.full(position.shape, sigma),
            torque=None,
            payload=None if self.payload is None else np.array(self.payload, dtype=float),
            target=np.array(self.target),
            station=np.array(self.station),
            temperature=None if self.temperature is None else np.array(self.temperature, dtype=float),
            pose=np.array(self.pose, dtype=int),
            sigma_given=given,
        )


@dataclass(frozen=True)
class Visit:
    """One visit to a robot.

    Attributes
    ----------
    date : str
        ISO 8601 date.
    files : mapping of str
        SHA-256 of the files of measured poses by name; the same readings are the same visit, whatever the file is called.
    calibration : str
        SHA-256 of the calibration that it was compared with.
    reference : bool
        Whether later visits are compared with it.
    verdict, sentence : str
        The judgement, as a word and in words.
    probability : float
        That chance makes errors as conspicuous in a robot as calibrated.
    shifts : list of ShiftAtVisit
        Of every joint, as if it alone had shifted.
    readings : Readings
        What was measured.
    alarms : list of str
        Joints whose cumulative sums had passed their limit.
    suspects : list
        Changes that explain the errors, as in results.json.
    placed : bool
        Whether the place of the instrument was fitted to it.
    """

    date: str
    files: dict[str, str]
    calibration: str
    reference: bool
    verdict: str
    sentence: str
    probability: float
    shifts: list[ShiftAtVisit]
    readings: Readings
    alarms: list[str]
    suspects: list[Any]
    placed: bool = False

    @property
    def steady(self) -> bool:
        """Whether the visit shows no change of the robot since what it was compared with, so that its shifts count for cumulative sums."""
        return self.verdict in ("as_calibrated", AS_AT_REFERENCE, "instrument_moved")


@dataclass(frozen=True)
class _Visits:
    kind: str
    schema: int
    robot: str
    visits: list[Visit]


def read_visits(folder: Path, robot: str) -> tuple[Visit, ...]:
    """Visits stored in a folder, by date; none where there is no file.

    Raises `InputError` for a file of another version, robot or program.
    """
    path = folder / VISITS
    if not current_path(path).is_file():
        return ()
    content = read_json(path, _ADVICE)
    known = (
        isinstance(content, Mapping) and content.get("kind") == "visits" and content.get("schema") == _SCHEMA
    )
    if not known:
        raise InputError("E-RECHECK-003", f"{path} holds no visits of this version of flexcal; {_ADVICE}.")
    try:
        stored = structure(content, _Visits)
    except FlexcalError as problem:
        raise InputError("E-RECHECK-004", f"{path} is damaged ({problem}); {_ADVICE}.") from problem
    if stored.robot != robot:
        raise InputError(
            "E-RECHECK-005",
            f"{path} has visits to the robot '{stored.robot}', and this one is '{robot}'; give another --out.",
        )
    return tuple(stored.visits)


def with_visit(visits: Sequence[Visit], visit: Visit) -> tuple[Visit, ...]:
    """Visits with one more, by date; one of the same readings and calibration is replaced."""
    others = [
        v for v in visits if v.calibration != visit.calibration or not same_visit(v.readings, visit.readings)
    ]
    return tuple(sorted([*others, visit], key=lambda v: v.date))


def same_visit(one: Readings, other: Readings) -> bool:
    """Whether two visits are the same measurements, in whatever order and files."""
    return one.shared(other) == len(one.pose) == len(other.pose)


def write_visits(folder: Path, robot: str, visits: Sequence[Visit]) -> None:
    """Write visits.json to a folder, atomically."""
    content = asdict(_Visits("visits", _SCHEMA, robot, list(visits)))
    write_text(folder / VISITS, json_text(content) + "\n")
