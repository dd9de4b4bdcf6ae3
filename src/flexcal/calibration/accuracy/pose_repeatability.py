"""Pose accuracy and repeatability of ISO 9283 from repeated visits to the same commanded poses."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import group_numbers
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError

SAME_COMMAND = 1e-4
"""Difference of joint positions, rad or m, up to which rows are visits to one commanded pose."""
_CELL = 10 * SAME_COMMAND
"""Cell size of the look-up of a command; no less than the tolerance."""
CYCLES = 30
"""Number of visits to each pose required by the standard."""
_NOISE = np.sqrt(8 / np.pi) + 3 * np.sqrt(3 - 8 / np.pi)
"""RP of many visits due to instrument noise alone, in units of its 1σ per axis: l̄ and S_l are those of a χ distribution."""


@dataclass(frozen=True, eq=False)
class PoseRepeatability:
    """One commanded pose: the `rows` (K,) of its visits in measuring order, and their statistics of ISO 9283:1998.

    `deviations` (K, 3) m from the barycentre; `repeatability` RP = l̄ + 3 S_l (7.2.2), m; `rotation` (3,) rad, 3 S about x, y, z of the
    instrument's frame, None where no orientation was measured; `direction_variation` vAP (7.2.3), m, the largest distance between the
    barycentres of visits that came from different poses, None where no two directions have two visits each.
    """

    rows: np.ndarray
    deviations: np.ndarray
    repeatability: float
    rotation: np.ndarray | None
    direction_variation: float | None

    def accuracy(self, errors: np.ndarray) -> float:
        """AP, m: the distance between barycentre and command (7.2.1), from `errors` (N, 3) of all rows, measured minus commanded."""
        return float(np.linalg.norm(errors[self.rows].mean(axis=0)))


def visit_statistics(poses: PoseSet) -> list[PoseRepeatability]:
    """Pose repeatability (ISO 9283:1998, 7.2) of the poses that were visited twice or more, in the order of their first visits.

    Rows belong to one pose where joint positions, target, station and payload are the same, whatever number they have. Raises
    `FlexcalError` for measured lengths, and where no pose was visited twice.
    """
    if poses.kind is not None:
        raise FlexcalError(
            "E-CAL-001", "lengths of a wire do not show where a point is; give points x, y, z."
        )
    number = _numbers(poses)
    order = np.argsort(number, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(number))[:-1])
    repeated = [_evaluate(poses, rows, number) for rows in groups if len(rows) > 1]
    if not repeated:
        raise FlexcalError(
            "E-CAL-002",
            f"each of the {len(poses)} poses was visited once only (joint positions within {SAME_COMMAND:g} rad count as the same); "
            f"visit some of them {CYCLES} times.",
        )
    return repeated


def repeatability_of(points: np.ndarray) -> float:
    """RP = l̄ + 3 S_l of points (K, 3), in their unit."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    return float(distance.mean() + 3 * distance.std(ddof=1))


def noise_repeatability(sigma: np.ndarray) -> float:
    """Repeatability RP, m, due to an instrument's 1σ noise (N, 3) alone, for many visits."""
    return _NOISE * float(np.sqrt((sigma**2).mean()))


def _numbers(poses: PoseSet) -> np.ndarray:
    """Number (N,) of every row's commanded pose, in the order of first appearance.

    A row belongs to the first pose before it that it is like; those are looked up in cells of their first and last joints, so that the time
    is linear in the rows.
    """
    payload = np.zeros(len(poses)) if poses.payload is None else poses.payload
    kinds = [np.unique(labels, return_inverse=True)[1] for labels in (poses.target, poses.station)]
    exact = group_numbers(np.column_stack([poses.q, payload, *kinds]))
    rows = np.unique(exact, return_index=True)[1]
    places = np.floor(poses.q[rows][:, [0, -1]] / _CELL).astype(np.int64).tolist()
    first: list[int] = []
    cells: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
    numbers = []
    for row, (one, other) in zip(rows.tolist(), places, strict=True):
        others = sorted(
            k
            for a in (one - 1, one, one + 1)
            for b in (other - 1, other, other + 1)
            for k in cells.get((a, b), ())
        )
        leaders = [first[k] for k in others]
        alike = (
            (np.abs(poses.q[leaders] - poses.q[row]) <= SAME_COMMAND).all(axis=1)
            & (kinds[0][leaders] == kinds[0][row])
            & (kinds[1][leaders] == kinds[1][row])
            & (payload[leaders] == payload[row])
        )
        if alike.any():
            numbers.append(others[int(np.argmax(alike))])
        else:
            numbers.append(len(first))
            cells[one, other].append(len(first))
            first.append(row)
    return np.array(numbers)[exact]


def _evaluate(poses: PoseSet, rows: np.ndarray, number: np.ndarray) -> PoseRepeatability:
    points = poses.position[rows]
    return PoseRepeatability(
        rows,
        points - points.mean(axis=0),
        repeatability_of(points),
        None if poses.quaternion_wxyz is None else _rotation_spread(poses.quaternion_wxyz[rows]),
        _direction_variation(points, rows, number),
    )


def _rotation_spread(quaternion_wxyz: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_quat(quaternion_wxyz, scalar_first=True)
    return 3 * (turns * turns.mean().inv()).as_rotvec().std(axis=0, ddof=1)


def _direction_variation(points: np.ndarray, rows: np.ndarray, number: np.ndarray) -> float | None:
    """Multidirectional variation; directions of approach are distinguished by the commanded pose measured before."""
    before = np.where(rows > 0, number[np.maximum(rows - 1, 0)], -1)
    labels, own, counts = np.unique(before, return_inverse=True, return_counts=True)
    sums = np.array([np.bincount(own, coordinate) for coordinate in points.T]).T
    several = (counts > 1) & (labels != -1) & (labels != number[rows[0]])
    if several.sum() < 2:
        return None
    centres = sums[several] / counts[several, None]
    return max(float(np.linalg.norm(centres - one, axis=1).max()) for one in centres)
