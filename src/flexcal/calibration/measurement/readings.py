"""Rows of the residual that the measurements of a pose set give, whatever was measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.poses import PoseSet

ABSENT, METRES, RADIANS = 0, 1, 2
"""Units of a coordinate, and of one that was not measured."""

POINTS = "points"
"""Kind of the measurements of whole points by an instrument."""
ROBOT = "robot"
"""Scatter of points, of the one kind of measurement, or of the first of several."""
OF_INSTRUMENTS = ("views", "sockets", "lengths", "contacts")
"""Scatter of the readings of the other kinds of measurements: of cameras, of balls in sockets, wires, and touched faces."""


@dataclass(frozen=True, eq=False)
class Readings:
    """R readings of three coordinates: every measured point in the order of the pose set, then M measured orientations or inclinations.

    `row` (R,) is the row of the pose set that a reading belongs to, `unit` (R, 3) that of each coordinate, METRES, RADIANS or ABSENT, and
    `sigma` (R, 3) its stated standard deviation, m or rad; 0 where it is absent, or none is stated beside others that are. `stated`
    (R, 3, 3) and `across` (M, 3, 3), between an orientation and its point, are the stated covariance where it is not diagonal; None where
    it is. `slopes` (N, 3, 3): change of the N points' readings with a displacement of the target in the instrument's axes; None where each
    reads its coordinates. `scatter` (R,): name of the component of the scatter that a point has for itself; None where all have "robot".
    """

    row: np.ndarray
    unit: np.ndarray
    sigma: np.ndarray
    stated: np.ndarray | None = None
    across: np.ndarray | None = None
    slopes: np.ndarray | None = None
    scatter: np.ndarray | None = None

    @classmethod
    def of(cls, poses: PoseSet, slopes: np.ndarray | None = None) -> Readings:
        """Readings of a pose set, with their `slopes` (N, 3, 3)."""
        points, turned = np.arange(len(poses)), np.flatnonzero(poses.angled)
        row = np.concatenate([points, turned])
        unit = np.full((len(row), 3), RADIANS)
        unit[: len(points)] = np.where(poses.present, METRES, ABSENT)
        if poses.tilt is not None:
            absent = poses.tilted[turned][:, None] & ~np.isfinite(poses.tilt[turned])
            unit[len(points) :][absent] = ABSENT
        angular = (
            np.zeros(len(turned)) if poses.orientation_sigma is None else poses.orientation_sigma[turned]
        )
        scatter = _scatter_names(poses, len(row))
        known = poses.present if poses.unstated is None else poses.present & ~poses.unstated[:, None]
        stated_of_points = np.where(known, poses.sigma, 0.0)
        there = unit[len(points) :] != ABSENT
        sigma = np.concatenate([stated_of_points, np.where(there, np.nan_to_num(angular)[:, None], 0.0)])
        if poses.covariance is None or not len(turned):
            return cls(row, unit, sigma, slopes=slopes, scatter=scatter)
        stated, across = sigma[:, :, None] ** 2 * np.eye(3), np.zeros((len(turned), 3, 3))
        joint = np.array(np.isfinite(poses.covariance).all(axis=(1, 2)))
        stated[points[joint]] = poses.covariance[joint, :3, :3]
        own = joint[turned]
        stated[len(points) :][own] = poses.covariance[turned[own], 3:, 3:]
        across[own] = poses.covariance[turned[own], 3:, :3]
        return cls(row, unit, sigma, stated, across, slopes, scatter)

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
            None if self.scatter is None else self.scatter[rows],
        )

    def of_scatter(self, name: str) -> np.ndarray:
        """Coordinates (R, 3), in m, of the points that have a component of the scatter for themselves."""
        lengths = self.unit == METRES
        if self.scatter is None:
            return lengths if name == ROBOT else np.zeros_like(lengths)
        return lengths & (self.scatter == name)[:, None]

    @cached_property
    def instruments(self) -> tuple[str, ...]:
        """Components of the scatter of single points besides `ROBOT`."""
        return () if self.scatter is None else tuple(n for n in OF_INSTRUMENTS if (self.scatter == n).any())

    @cached_property
    def turns(self) -> int:
        """Number of orientations M."""
        return int((~self.points).sum())

    @cached_property
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


def stated_sigma(readings: Readings) -> float:
    """Stated standard deviation of a point's coordinate, m, root mean square; 0 where none is stated."""
    own = readings.sigma[(readings.unit == METRES) & (readings.sigma > 0)]
    return float(np.sqrt(np.mean(own**2))) if own.size else 0.0


def _scatter_names(poses: PoseSet, readings: int) -> np.ndarray | None:
    """Components of the scatter of all readings (R,), points first; None for one kind of measurement.

    The first kind whose noise is stated, or the first of all, has that of the robot.
    """
    if poses.kind is None and poses.camera is None and poses.socket is None:
        return None
    kind = kind_names(poses)
    kind[poses.tilted] = ROBOT
    there = [name for name in (POINTS, *OF_INSTRUMENTS) if (kind == name).any()]
    if len(there) < 2:
        return None
    stated = [name for name in there if poses.stated[kind == name].all()]
    kind[kind == (stated or there)[0]] = ROBOT
    return np.concatenate([kind, np.full(readings - len(poses), ROBOT, dtype=object)])


def kind_names(poses: PoseSet) -> np.ndarray:
    """Names (N,) of the kinds of measurements: `POINTS`, or one of `OF_INSTRUMENTS`."""
    kind = np.full(len(poses), POINTS, dtype=object)
    faces = np.zeros(len(poses), bool) if poses.kind is None else ~poses.far & (poses.kind != "")
    if poses.kind is not None:
        faces |= poses.far & (poses.position[:, 0] == 0)
    for name, rows in zip(OF_INSTRUMENTS, (poses.seen, poses.in_socket, poses.far, faces), strict=True):
        kind[rows] = name
    return kind
