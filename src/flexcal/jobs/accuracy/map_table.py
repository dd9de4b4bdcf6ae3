"""Table of an accuracy map: one row a pose."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.calibration.accuracy import PredictedAccuracy
from flexcal.data.tables import open_table, write_table
from flexcal.units import MILLIMETRE

_ERRORS = ("mean_mm", "p95_mm")
_UNCALIBRATED = "uncalibrated_mm"
_WORST = 5
_APART = 0.1
"""Least distance between the listed worst places, relative to the extent of all points."""


@dataclass(frozen=True, eq=False)
class MapTable:
    """The table.

    Attributes
    ----------
    predicted : PredictedAccuracy
        Predicted errors of the calibrated robot.
    uncalibrated : ndarray or None
        Errors (N,), m, of the uncalibrated one; None where they are not known.
    """

    predicted: PredictedAccuracy
    uncalibrated: np.ndarray | None

    @classmethod
    def read(cls, path: Path) -> MapTable:
        """Read a table that `write` wrote; raises `InputError` where it is another one."""
        file = open_table(path)
        joints = [name for name in file.columns if name[:1] == "q" and name[1:].isdigit()]
        missing = [name for name in (*"xyz", "q1", *_ERRORS) if name not in file.columns]
        if missing:
            raise file.error(
                "E-RUN-108",
                f"no accuracy map: it has no column '{missing[0]}'; give the table that 'flexcal map --out' wrote.",
            )
        columns = file.read().columns
        mean, p95 = (MILLIMETRE * columns[name] for name in _ERRORS)
        return cls(
            PredictedAccuracy(
                np.stack([columns[name] for name in joints], axis=1),
                np.stack([columns[axis] for axis in "xyz"], axis=1),
                mean,
                p95,
            ),
            MILLIMETRE * columns[_UNCALIBRATED] if _UNCALIBRATED in columns else None,
        )

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Columns by the names in the file."""
        predicted = self.predicted
        columns = {name: predicted.position[:, i] for i, name in enumerate("xyz")}
        columns |= {f"q{i + 1}": predicted.q[:, i] for i in range(predicted.q.shape[1])}
        columns |= {"mean_mm": predicted.mean / MILLIMETRE, "p95_mm": predicted.p95 / MILLIMETRE}
        if self.uncalibrated is not None:
            columns[_UNCALIBRATED] = self.uncalibrated / MILLIMETRE
        return columns

    def write(self, path: Path) -> None:
        """Write it as CSV or Parquet, by the suffix."""
        write_table(path, self.columns)


def worst_places(predicted: PredictedAccuracy) -> np.ndarray:
    """Rows of the worst places, apart from each other, the worst first."""
    return places_apart(predicted, least_distance(predicted))


def least_distance(predicted: PredictedAccuracy) -> float:
    """Distance, m, from which two of the worst places are apart."""
    return _APART * float(np.linalg.norm(np.ptp(predicted.position, axis=0)))


def places_apart(predicted: PredictedAccuracy, least: float) -> np.ndarray:
    """Rows of the worst places, at least `least` m from each other, the worst first."""
    chosen: list[int] = []
    for k in np.argsort(-predicted.p95, kind="stable"):
        if all(np.linalg.norm(predicted.position[k] - predicted.position[c]) >= least for c in chosen):
            chosen.append(int(k))
        if len(chosen) == _WORST:
            break
    return np.array(chosen)
