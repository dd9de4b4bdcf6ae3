"""Stratified sample of a measurement with too many points for a fit with variance components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import SAME_COMMAND, ErrorStatistics, group_numbers, occurrence
from flexcal.calibration.measurement import predicted_positions
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

MOST = 4_000
"""Largest number of points of a fit: of p parameters their noise contributes √(p/3N), a twentieth of its size, to the calibrated tool, far
below any instrument's own error.
"""
_COMMANDS = 400
"""Number of positions of which several visits are kept."""
_LEAST = 100
"""Least number of positions per station and payload, if available and together no more than the others."""
_PAYLOADS = 20
"""Largest number of payloads of a station; more are measured values of each pose, not changes of payload."""


@dataclass(frozen=True, eq=False)
class StratifiedSample:
    """Sample of `rows` (M,) out of `total`, drawn evenly over positions, stations and payloads, in measuring order.

    Visits to a pose are kept whole. Where positions were visited again, several visits, evenly in time, of fewer positions are kept.
    """

    rows: np.ndarray
    total: int

    @classmethod
    def of(cls, poses: PoseSet, most: int = MOST) -> StratifiedSample | None:
        """Sample of about `most` rows, deterministic; None if there are no more than that."""
        if len(poses) <= most:
            return None
        _, target = np.unique(poses.target, return_inverse=True)
        visit = group_numbers(np.column_stack([poses.pose, occurrence(group_numbers(poses.pose, target))]))
        first = np.unique(visit, return_index=True)[1]
        command = group_numbers(np.round(poses.q[first] / SAME_COMMAND))
        _, station = np.unique(poses.station[first], return_inverse=True)
        stratum = station
        if poses.payload is not None:
            own = group_numbers(station, poses.payload[first])
            stratum = own if own.max() < _PAYLOADS * (station.max() + 1) else station
        kept = _kept_visits(command, stratum, most * len(first) // len(poses))
        return cls(np.flatnonzero(np.isin(visit, kept)), len(poses))


def _kept_visits(command: np.ndarray, stratum: np.ndarray, budget: int) -> np.ndarray:
    """Numbers of about `budget` visits, whose commands and strata are given (V,)."""
    rng = np.random.default_rng(0)
    order = np.argsort(command, kind="stable")
    starts = np.flatnonzero(np.diff(command[order], prepend=-1))
    counts = np.diff(np.append(starts, len(command)))
    again = len(command) >= 2 * len(starts)
    wanted = min(len(starts), _COMMANDS if again else budget)
    each = max(1, budget // wanted) if again else 1
    chosen = []
    own = stratum[order[starts]]
    strata = np.unique(own)
    least = min(_LEAST, max(1, wanted // len(strata)))
    for one in strata:
        members = np.flatnonzero(own == one)
        share = max(min(len(members), least), wanted * len(members) // len(starts))
        chosen.append(rng.permutation(members)[:share])
    positions = np.concatenate(chosen)
    taken = np.minimum(each, counts[positions])
    number = np.arange(taken.sum()) - np.repeat(np.cumsum(taken) - taken, taken)
    visit = number * np.repeat(counts[positions] - 1, taken) // np.repeat(np.maximum(taken - 1, 1), taken)
    return order[np.repeat(starts[positions], taken) + visit]


def all_errors(model: RobotModel, poses: PoseSet, progress: Progress = silent) -> ErrorStatistics:
    """Errors of a calibrated robot at any number of poses, in constant memory besides these."""
    return ErrorStatistics.of(poses.position - predicted_positions(model, poses, progress=progress))
