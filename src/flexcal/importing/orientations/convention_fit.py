"""Fit of the nominal robot to measured orientations: which convention makes them those of this robot.

With measured orientations R_i, points p_i and the nominal robot's orientations N_i and points n_i,

    R_i ≈ S N_i E,    p_i ≈ t + S (n_i + N_i c),

where S and t place the robot before the instrument, and E and c the target on the tool: the robot-world and hand-eye problem (Zhuang, Roth
and Sudhakar, IEEE Trans. Robotics and Automation 10, 1994). The orientations alone leave S open to a relabelling of axes, which many
conventions differ by; the points determine it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.importing.orientations.conventions import Convention
from flexcal.model.parts import rotation_vector, vector_rotation

_STEPS = 5
_MOST_FITTED = 60
"""Largest number of rows from which the robust start is computed."""
_SCATTERED = 3.0
"""Rows beyond so many medians of the residual angle do not count in the fit."""
_ODD = 8.0
_ODD_LEAST = np.deg2rad(1.0)
"""Rows beyond so many medians, and this angle, are of another convention or wrong."""


@dataclass(frozen=True, eq=False)
class NominalPoses:
    """Points `position` (N, 3), m, and frames `orientation` (N, 3, 3) of the nominal robot, the measured points `xyz` (N, 3), m, in the
    instrument's frame, the robot's `reach` (m), and `shift` (3,), m: where the point is in its frame beside where it was declared.
    """

    position: np.ndarray
    orientation: np.ndarray
    xyz: np.ndarray
    reach: float
    shift: np.ndarray

    def __len__(self) -> int:
        return len(self.xyz)

    def rows(self, chosen: np.ndarray) -> NominalPoses:
        """The poses of some rows."""
        return NominalPoses(
            self.position[chosen], self.orientation[chosen], self.xyz[chosen], self.reach, self.shift
        )

    def spread(self) -> float:
        """Rms angle (rad) of the orientations about their mean."""
        return _rms(_angles(_mean(self.orientation).T @ self.orientation))


@dataclass(frozen=True, eq=False)
class OrientationFit:
    """Orientations read by a convention, beside the nominal robot.

    angles: residuals (N,), rad. misfit: rms (rad) of the angles and of the points' residuals divided by the reach, over the rows that are
    not scattered. rotations: as read (N, 3, 3). predicted: those of the robot (N, 3, 3).
    """

    convention: Convention
    rotations: np.ndarray
    predicted: np.ndarray
    angles: np.ndarray
    misfit: float

    @property
    def rms(self) -> float:
        """Rms residual angle, rad, of the rows that are not odd."""
        return _rms(self.angles[~self.odd])

    @property
    def odd(self) -> np.ndarray:
        """Rows (N,) whose residual angles are not those of the others."""
        return self.angles > odd_angle(self.angles)

    def same_as(self, other: OrientationFit, within: float) -> bool:
        """Whether both readings differ by a constant rotation of the target alone, but for `within` (rad, rms)."""
        between = np.swapaxes(self.rotations, 1, 2) @ other.rotations
        return _rms(_angles(_mean(between).T @ between)) < within


def fit_orientations(nominal: NominalPoses, convention: Convention, values: np.ndarray) -> OrientationFit:
    """Read `values` (N, 3) or (N, 4) by a convention, and register the nominal robot with them and with the points.

    The start is robust: S from the points (Kabsch), E from the row whose estimate of it lies nearest to those of most others. Gauss-Newton
    steps over S, t, c and E follow, with residuals of points divided by the reach.
    """
    rotations = convention.rotations(values)
    station, origin, shift = *_station(nominal), nominal.shift
    tools = np.swapaxes(station @ nominal.orientation, 1, 2) @ rotations
    some = np.unique(np.linspace(0, len(tools) - 1, min(len(tools), _MOST_FITTED)).astype(int))
    between = np.array([_angles(tool.T @ tools[some]) for tool in tools[some]])
    tool = tools[some[int(np.argmin(np.median(between, axis=1)))]]
    kept = _kept(_angles(tool.T @ tools))
    tool = _mean(tools[kept])
    for _ in range(_STEPS):
        step = _step(nominal.rows(kept), rotations[kept], station, origin, shift, tool)
        station, tool = vector_rotation(step[:3]) @ station, tool @ vector_rotation(step[9:])
        origin, shift = origin + step[3:6], shift + step[6:9]
    predicted = station @ nominal.orientation @ tool
    angles = _angles(np.swapaxes(predicted, 1, 2) @ rotations)
    missed = nominal.xyz - origin - (nominal.position + nominal.orientation @ shift) @ station.T
    points = np.mean(np.sum(missed[kept] ** 2, axis=1)) / nominal.reach**2
    misfit = float(np.sqrt(np.mean(angles[kept] ** 2) + points))
    return OrientationFit(convention, rotations, predicted, angles, misfit)


def odd_angle(angles: np.ndarray) -> float:
    """Residual angle (rad) from which one is not of the others (N,)."""
    return max(_ODD_LEAST, _ODD * float(np.median(angles)))


def _kept(angles: np.ndarray) -> np.ndarray:
    return angles <= _SCATTERED * float(np.median(angles)) + 1e-9


def _station(nominal: NominalPoses) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and translation (3,) from the robot's base to the instrument, of the points alone: Kabsch."""
    points = nominal.position + nominal.orientation @ nominal.shift
    u, _, vt = np.linalg.svd((nominal.xyz - nominal.xyz.mean(axis=0)).T @ (points - points.mean(axis=0)))
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation, nominal.xyz.mean(axis=0) - rotation @ points.mean(axis=0)


def _step(
    nominal: NominalPoses,
    rotations: np.ndarray,
    station: np.ndarray,
    origin: np.ndarray,
    shift: np.ndarray,
    tool: np.ndarray,
) -> np.ndarray:
    """Gauss-Newton step (12,): rotation of S from the left, t, c, rotation of E from the right."""
    rows, ones = len(nominal), np.broadcast_to(np.eye(3), (len(nominal), 3, 3))
    turned = station @ nominal.orientation
    reached = (nominal.position + nominal.orientation @ shift) @ station.T
    zeros = np.zeros((rows, 3, 3))
    of_points = np.concatenate([-_skew(reached), ones, turned, zeros], axis=2) / nominal.reach
    predicted = turned @ tool
    of_angles = np.concatenate([np.swapaxes(predicted, 1, 2), zeros, zeros, ones], axis=2)
    missed = (nominal.xyz - origin - reached) / nominal.reach
    left = rotation_vector(np.swapaxes(predicted, 1, 2) @ rotations)
    system = np.concatenate([of_points, of_angles]).reshape(-1, 12)
    return np.linalg.lstsq(system, np.concatenate([missed, left]).ravel(), rcond=1e-9)[0]


def _skew(vectors: np.ndarray) -> np.ndarray:
    """Skew-symmetric matrices (N, 3, 3) of vectors (N, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def _mean(rotations: np.ndarray) -> np.ndarray:
    """Chordal mean (3, 3) of rotations (N, 3, 3)."""
    u, _, vt = np.linalg.svd(rotations.sum(axis=0))
    return u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt


def _angles(rotations: np.ndarray) -> np.ndarray:
    """Angles (N,), rad, of rotations (N, 3, 3), also exact where they are small."""
    skew = rotations - np.swapaxes(rotations, 1, 2)
    sine = 0.5 * np.linalg.norm(skew[:, [2, 0, 1], [1, 2, 0]], axis=1)
    return np.arctan2(sine, 0.5 * (np.trace(rotations, axis1=1, axis2=2) - 1))


def _rms(angles: np.ndarray) -> float:
    return float(np.sqrt(np.mean(angles**2)))
