"""What the rows so far tell: which can be used, the estimate from them, and disturbances of the series."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.calibration.fit import with_reference_temperature
from flexcal.calibration.measurement import predict_measurements, register
from flexcal.data.poses import PoseSet
from flexcal.jobs.calibration import plausible_temperatures
from flexcal.jobs.guidance.consistency import FEWEST, ConsistentRows
from flexcal.jobs.guidance.disturbances import Disturbance, most_probable, verified
from flexcal.jobs.guidance.estimate import SessionEstimate
from flexcal.jobs.guidance.unknowns import Unknowns
from flexcal.model.robot import RobotModel
from flexcal.units import COLDEST, HOTTEST

_MOST = 8
"""Most disturbances that are told apart in one series."""


@dataclass(frozen=True, eq=False)
class Analysis:
    """Analysis of N rows of a series in the order of measuring.

    `consistent` are the rows of the estimate; those left out are grossly wrong. `disturbances` have row numbers among the used ones.
    `estimate` is None where too few rows are consistent, or their points lie on a line.
    """

    rows: PoseSet
    consistent: ConsistentRows
    estimate: SessionEstimate | None
    disturbances: tuple[Disturbance, ...]

    @classmethod
    def of(cls, model: RobotModel, rows: PoseSet) -> Analysis:
        """Analysis of rows measured with the robot `model` as described, not calibrated."""
        likely = with_implausible_temperatures_replaced(rows)
        model = with_reference_temperature(model, likely)
        predicted = predict_measurements(model, likely).located
        consistent = ConsistentRows.of(predicted, rows)
        used = consistent.used
        if used.sum() < FEWEST:
            return cls(rows, consistent, None, ())
        kept = likely.subset(used)
        start = register(model, kept, predicted[used])
        unknowns = Unknowns.of(start, kept)
        estimate = SessionEstimate.of(start, kept, unknowns)
        found: list[Disturbance] = []
        while len(found) < _MOST and (item := most_probable(estimate, found)) is not None:
            further = np.concatenate([one.columns for one in (*found, item)], axis=2)
            disturbed = SessionEstimate.of(start, kept, unknowns, near=estimate, further=further)
            item = verified(disturbed, item)
            if item is None:
                break
            found.append(item)
            estimate = disturbed
        return cls(rows, consistent, estimate, tuple(found))

    @property
    def used(self) -> np.ndarray:
        """Rows (N,) of the estimate."""
        return self.consistent.used

    @cached_property
    def index(self) -> np.ndarray:
        """Indices (M,) of the used rows."""
        return np.flatnonzero(self.used)

    @cached_property
    def far_off(self) -> dict[int, float]:
        """Distances, m, by row, of points too far from where the robot was for any estimate, where most rows of their station are not."""
        if self.estimate is None:
            return {}
        far: list[int] = []
        for station in self.rows.stations:
            own = np.flatnonzero(self.rows.station == station)
            if self.used[own].sum() * 2 > len(own):
                far += own[~self.used[own]].tolist()
        if not far:
            return {}
        rows = self.rows.subset(far)
        off = np.linalg.norm(rows.position - self.estimate.predicted(rows)[0], axis=1)
        return dict(zip(far, off.tolist(), strict=True))

    def pose_of(self, item: Disturbance) -> int:
        """Number of the pose at which a disturbance is, or begins."""
        return int(self.rows.pose[self.index[item.row]])

    def shift_of(self, item: Disturbance) -> tuple[np.ndarray, np.ndarray]:
        """Estimated displacements (M, 3), m, of the used rows by a disturbance, and their covariance (M, 3, 3), m²."""
        estimate = self.estimate
        assert estimate is not None
        first = len(estimate.unknowns)
        for one in self.disturbances:
            size = one.columns.shape[2]
            if one is item:
                part = slice(first, first + size)
                shift = item.columns @ estimate.change[part]
                own = item.columns @ estimate.covariance[part, part] @ np.swapaxes(item.columns, 1, 2)
                return shift, own
            first += size
        raise ValueError(item)


def with_implausible_temperatures_replaced(rows: PoseSet) -> PoseSet:
    """Rows with the median in place of temperatures that cannot be the arm's, as of a sensor that failed for a moment."""
    if rows.temperature is None:
        return rows
    likely = plausible_temperatures(rows) & (rows.temperature >= COLDEST) & (rows.temperature <= HOTTEST)
    if likely.all() or not likely.any():
        return rows
    return replace(rows, temperature=np.where(likely, rows.temperature, np.median(rows.temperature[likely])))
