"""Start values from readings that may be wrong: least squares with weights of the Cauchy loss, checks, principal directions.

Readings typed by hand are wrong by decimetres now and then.
"""

from __future__ import annotations

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

PASSES = 50
"""Number of repetitions of a reweighted fit."""
FLAT = 1e-2
"""Ratio of extents of the targets below which they lie in a plane, or on a line."""
_FOREIGN = 0.05
"""Median misfit, relative to the extent of the targets, above which readings and robot do not belong together."""
_NOMINAL = 0.01
"""Misfit, relative to the reach, that a nominal robot may have."""
_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal variable."""
_CAUCHY = 2.385
"""Constant of the Cauchy loss with 95 % efficiency for normal errors."""
_SMALLEST = 1e-9


def require_targets(name: str, targets: np.ndarray, least: int) -> None:
    """Raise `FlexcalError` for fewer than the `least` number of targets (K, 3) by which a station can be placed."""
    if len(targets) < least:
        raise FlexcalError(
            "E-CAL-020", f"'{name}' has {len(targets)} measurements; at least {least} are needed to place it."
        )


def require_fitting(model: RobotModel, name: str, misfit: np.ndarray, targets: np.ndarray) -> None:
    """Raise `FlexcalError` where the `misfit` (K,), m, of the readings is that of other targets than these (K, 3).

    Targets on a small ball lie close together whatever the errors of the nominal robot.
    """
    extents = np.linalg.svd(targets - np.median(targets, axis=0), compute_uv=False)
    away, extent = float(np.median(np.abs(misfit))), float(extents[0]) / np.sqrt(len(targets))
    if away > max(_FOREIGN * extent, _NOMINAL * model.reach):
        raise FlexcalError(
            "E-CAL-023",
            f"the readings of '{name}' differ by {away / MILLIMETRE:.0f} mm (median) from those at any place: check their unit, the order "
            "and units of the joint positions, the joints' zeros, and the measured point under `points:`.",
        )


def station_numbers(offset: np.ndarray, turn: np.ndarray, zero: float) -> dict[str, float]:
    """Numbers of a station by their keys: offset (3,), m, rotation vector (3,), rad, and zero, m."""
    numbers = zip(("x", "y", "z", "rx", "ry", "rz", "zero"), (*offset, *turn, zero), strict=True)
    return {key: float(value) for key, value in numbers}


def station_along(direction: np.ndarray, through: np.ndarray) -> dict[str, float]:
    """Numbers of a station whose z axis has a direction (3,) and passes through a point (3,), m, the origin, in the base frame."""
    turn = turn_to_z(direction)
    return station_numbers(-vector_rotation(turn) @ through, turn, 0.0)


def cauchy_weights(misfit: np.ndarray) -> np.ndarray:
    """Weights (K,) of the Cauchy loss, with the scale of the median misfit."""
    scale = float(np.median(np.abs(misfit))) / _MEDIAN + _SMALLEST
    return 1 / (1 + (misfit / (_CAUCHY * scale)) ** 2)


def principal_directions(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Principal directions (3, 3), the rows, of weighted points (K, 3) about their mean, the longest first."""
    away = points - np.average(points, axis=0, weights=weights)
    values, vectors = np.linalg.eigh((weights[:, None] * away).T @ away)
    return vectors[:, np.argsort(-values)].T


def turn_to_z(direction: np.ndarray) -> np.ndarray:
    """Rotation vector (3,) of the smallest rotation of a direction (3,) to the z axis."""
    axis = np.cross(direction, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, direction[2]))
    return angle * (axis / size if size > _SMALLEST else np.array([1.0, 0.0, 0.0]))
