"""Start values for the place of a wire's anchor, and of a touched sphere, plane or line, from where the robot's target was.

Least squares with weights of the Cauchy loss: readings typed by hand are wrong by decimetres now and then.
"""

from __future__ import annotations

import numpy as np

from flexcal.data.poses import DISTANCE, PLANE
from flexcal.errors import FlexcalError
from flexcal.model.parts import vector_rotation
from flexcal.units import MILLIMETRE

_PASSES = 50
_FLAT = 1e-2
"""Ratio of extents of the targets below which they lie in a plane, or on a line."""
_LEAST = {DISTANCE: 5, PLANE: 4}
_FOREIGN = 0.05
"""Median misfit, relative to the extent of the targets, above which readings and robot do not belong together."""
_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal variable."""
_CAUCHY = 2.385
"""Constant of the Cauchy loss with 95 % efficiency for normal errors."""
_SMALLEST = 1e-9


def start_of_station(kind: str, name: str, targets: np.ndarray, readings: np.ndarray) -> dict[str, float]:
    """Numbers x, y, z, rx, ry, rz and `zero` of a station that read `readings` (N, 3) of `targets` (N, 3), m, in the base frame.

    Raises `FlexcalError` for too few or badly distributed targets, and where the readings fit no place.
    """
    least = _LEAST.get(kind, 4)
    if len(targets) < least:
        raise FlexcalError(
            "E-CAL-020", f"'{name}' has {len(targets)} measurements; at least {least} are needed to place it."
        )
    centre = np.median(targets, axis=0)
    extents = np.linalg.svd(targets - centre, compute_uv=False)
    if kind == DISTANCE:
        if extents[2] < _FLAT * extents[0]:
            raise FlexcalError(
                "E-CAL-021",
                f"the positions measured from '{name}' lie in a plane, on either side of which it could be; measure poses distributed "
                "in space.",
            )
        anchor, zero, misfit = _centre_of_distances(targets - centre, readings[:, 0])
        turn, offset = np.zeros(3), -(anchor + centre)
    else:
        if extents[1] < _FLAT * extents[0] and kind == PLANE:
            raise FlexcalError(
                "E-CAL-022",
                f"the points touched on '{name}' lie on a line; touch the plane where it is wide.",
            )
        find = _plane if kind == PLANE else _line
        normal, through, misfit = find(targets, readings[:, 2])
        turn, zero = turn_to_z(normal), 0.0
        offset = -vector_rotation(turn) @ through
    away, extent = float(np.median(np.abs(misfit))), float(extents[0]) / np.sqrt(len(targets))
    if away > _FOREIGN * extent:
        raise FlexcalError(
            "E-CAL-023",
            f"the readings of '{name}' differ by {away / MILLIMETRE:.0f} mm (median) from those at any place: check their unit, the order "
            "and units of the joint positions, and the measured point under `points:`.",
        )
    numbers = zip(("x", "y", "z", "rx", "ry", "rz", "zero"), (*offset, *turn, zero), strict=True)
    return {key: float(value) for key, value in numbers}


def _weights(misfit: np.ndarray) -> np.ndarray:
    """Weights (N,) of the Cauchy loss, with the scale of the median misfit."""
    scale = float(np.median(np.abs(misfit))) / _MEDIAN + _SMALLEST
    return 1 / (1 + (misfit / (_CAUCHY * scale)) ** 2)


def _centre_of_distances(points: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Point (3,) and zero, m, with |p - centre| = length + zero, and the misfit (N,): linear first, then by Gauss-Newton."""
    known = np.ptp(lengths) > 0
    columns = np.column_stack([2 * points, np.ones(len(points)), *([2 * lengths] if known else [])])
    squares = (points**2).sum(axis=1) - lengths**2
    solution = np.linalg.lstsq(columns, squares, rcond=None)[0]
    weights = np.ones(len(points))
    for _ in range(_PASSES):
        root = np.sqrt(weights)
        solution = np.linalg.lstsq(root[:, None] * columns, root * squares, rcond=None)[0]
        weights = _weights(squares - columns @ solution)
    centre = solution[:3]
    zero = float(solution[4]) if known else float(np.sqrt(max(solution[3] + centre @ centre, 0.0)))
    for _ in range(_PASSES):
        away = points - centre
        distance = np.linalg.norm(away, axis=1)
        misfit = lengths + zero - distance
        root = np.sqrt(_weights(misfit))
        slopes = np.column_stack([-away / distance[:, None], -np.ones(len(points))])
        step = np.linalg.lstsq(root[:, None] * slopes, root * misfit, rcond=None)[0]
        centre, zero = centre + step[:3], zero + float(step[3])
    return centre, zero, lengths + zero - np.linalg.norm(points - centre, axis=1)


def _plane(points: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal (3,) of the plane from which points are at the distances `readings`, a point (3,) in it, and the misfit (N,).

    The normal has a positive largest coordinate where the readings do not tell its sign.
    """
    first = _directions(points, np.ones(len(points)))[2]
    first = first * np.sign(first[np.argmax(np.abs(first))])
    fits = [_plane_about(points, readings, sign * first) for sign in (1.0, -1.0)]
    return min(fits, key=lambda fit: float(np.median(np.abs(fit[2]))))


def _plane_about(
    points: np.ndarray, readings: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `_plane`, with a normal on the side of a given one."""
    through = (points - readings[:, None] * normal).mean(axis=0)
    misfit = np.zeros(len(points))
    for _ in range(_PASSES):
        inside, weights = points - readings[:, None] * normal, _weights(misfit)
        found = _directions(inside, weights)[2]
        normal = found if found @ normal > 0 else -found
        through = np.average(inside, axis=0, weights=weights)
        misfit = (points - through) @ normal - readings
    return normal, through, misfit


def _line(points: np.ndarray, _readings: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direction (3,) of a line, a point (3,) on it, and the distances (N,) of the points from it."""
    direction, through, misfit = np.zeros(3), points.mean(axis=0), np.zeros(len(points))
    for _ in range(_PASSES):
        weights = _weights(misfit)
        through = np.average(points, axis=0, weights=weights)
        direction = _directions(points, weights)[0]
        away = points - through
        misfit = np.linalg.norm(away - np.outer(away @ direction, direction), axis=1)
    return direction, through, misfit


def turn_to_z(direction: np.ndarray) -> np.ndarray:
    """Rotation vector (3,) of the smallest rotation of a direction (3,) to the z axis."""
    axis = np.cross(direction, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, direction[2]))
    return angle * (axis / size if size > _SMALLEST else np.array([1.0, 0.0, 0.0]))


def _directions(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Principal directions (3, 3), the rows, of weighted points (N, 3) about their mean, the longest first."""
    away = points - np.average(points, axis=0, weights=weights)
    values, vectors = np.linalg.eigh((weights[:, None] * away).T @ away)
    return vectors[:, np.argsort(-values)].T
