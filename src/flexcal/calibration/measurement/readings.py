"""Rows of the residual that the measurements of a pose set give, whatever was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.poses import PoseSet

METRES, RADIANS = 1, 2
"""Units of a coordinate."""


@dataclass(frozen=True, eq=False)
class Readings:
    """R readings of three coordinates: every measured point in the order of the pose set, then every measured orientation.

    `row` (R,) is the row of the pose set that a reading belongs to, `unit` (R, 3) that of each coordinate, METRES or RADIANS, and
    `sigma` (R, 3) its stated standard deviation, m or rad; 0 where none is stated of an orientation.
    """

    row: np.ndarray
    unit: np.ndarray
    sigma: np.ndarray

    @classmethod
    def of(cls, poses: PoseSet) -> Readings:
        """Readings of a pose set."""
        points, turned = np.arange(len(poses)), np.flatnonzero(poses.turned)
        row = np.concatenate([points, turned])
        unit = np.full((len(row), 3), METRES)
        unit[len(points) :] = RADIANS
        stated = poses.orientation_sigma
        angular = np.zeros(len(turned)) if stated is None else stated[turned]
        return cls(
            row, unit, np.concatenate([poses.sigma, np.broadcast_to(angular[:, None], (len(turned), 3))])
        )

    @property
    def only_points(self) -> bool:
        """Whether every row of the pose set is a point and nothing else."""
        return not (self.unit == RADIANS).any()
