"""Rows of the residual that the measurements of a pose set give, whatever was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.poses import PoseSet

ABSENT, METRES, RADIANS = 0, 1, 2
"""Units of a coordinate, and of one that was not measured."""


@dataclass(frozen=True, eq=False)
class Readings:
    """R readings of three coordinates: every measured point in the order of the pose set, then each of M measured orientations.

    `row` (R,) is the row of the pose set that a reading belongs to, `unit` (R, 3) that of each coordinate, METRES, RADIANS or ABSENT, and
    `sigma` (R, 3) its stated standard deviation, m or rad; 0 where it is absent, or none is stated of an orientation. `stated`
    (R, 3, 3) and `across` (M, 3, 3), between an orientation and its point, are the stated covariance where it is not diagonal; None where
    it is. `slopes` (N, 3, 3): change of the N points' readings with a displacement of the target in the instrument's axes; None where each
    reads its coordinates.
    """

    row: np.ndarray
    unit: np.ndarray
    sigma: np.ndarray
    stated: np.ndarray | None = None
    across: np.ndarray | None = None
    slopes: np.ndarray | None = None

    @classmethod
    def of(cls, poses: PoseSet, slopes: np.ndarray | None = None) -> Readings:
        """Readings of a pose set, with their `slopes` (N, 3, 3)."""
        points, turned = np.arange(len(poses)), np.flatnonzero(poses.turned)
        row = np.concatenate([points, turned])
        unit = np.full((len(row), 3), RADIANS)
        unit[: len(points)] = np.where(poses.present, METRES, ABSENT)
        angular = (
            np.zeros(len(turned)) if poses.orientation_sigma is None else poses.orientation_sigma[turned]
        )
        stated_of_points = np.where(poses.present, poses.sigma, 0.0)
        sigma = np.concatenate([stated_of_points, np.broadcast_to(angular[:, None], (len(turned), 3))])
        if poses.covariance is None or not len(turned):
            return cls(row, unit, sigma, slopes=slopes)
        stated, across = sigma[:, :, None] ** 2 * np.eye(3), np.zeros((len(turned), 3, 3))
        joint = np.array(np.isfinite(poses.covariance).all(axis=(1, 2)))
        stated[points[joint]] = poses.covariance[joint, :3, :3]
        own = joint[turned]
        stated[len(points) :][own] = poses.covariance[turned[own], 3:, 3:]
        across[own] = poses.covariance[turned[own], 3:, :3]
        return cls(row, unit, sigma, stated, across, slopes)

    def subset(self, rows: np.ndarray) -> Readings:
        """The readings of a mask (R,) that keeps point and orientation of a pose together."""
        turned = rows[len(rows) - self.turns :]
        return Readings(
            self.row[rows],
            self.unit[rows],
            self.sigma[rows],
            None if self.stated is None else self.stated[rows],
            None if self.across is None else self.across[turned],
            None if self.slopes is None else self.slopes[rows[: len(self.slopes)]],
        )

    @property
    def turns(self) -> int:
        """Number of orientations M."""
        return int((~self.points).sum())

    @property
    def points(self) -> np.ndarray:
        """Readings (R,) that are points."""
        return (self.unit != RADIANS).all(axis=1)

    @property
    def present(self) -> np.ndarray:
        """Coordinates (R, 3) that were measured."""
        return self.unit != ABSENT

    @property
    def beside(self) -> np.ndarray:
        """Numbers (M,) of the points' readings beside the orientations."""
        first = np.zeros(int(self.row.max(initial=-1)) + 1, dtype=int)
        first[self.row[self.points]] = np.arange(int(self.points.sum()))
        return first[self.row[~self.points]]

    @property
    def blocks(self) -> np.ndarray:
        """Stated covariances (R, 3, 3) of the readings."""
        return self.sigma[:, :, None] ** 2 * np.eye(3) if self.stated is None else self.stated
