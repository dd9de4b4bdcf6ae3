"""Rigid motions between corresponding points, by which instruments of points are registered."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.parts import rotation_vector
from flexcal.model.robot import STATION

ALREADY_ALIGNED = 0.010
"""Median distance, m, between nominal and measured points below which instrument and base frame are the same."""
_GROSS = 10.0
"""Ratio to the median misfit beyond which a point's, if it is more than `ALREADY_ALIGNED` larger, is that of a wrong reading."""
LEAST_REGISTERED = 3
"""Least number of points that tell where an instrument stands."""
_FEWEST, _REFERENCES = 4, 64
"""Number of points that are registered at least, and of those that each is compared with."""


def wrong_readings(misfit: np.ndarray) -> np.ndarray:
    """Mask (N,) of the points whose misfit (N,), m, is far larger than that of most."""
    return misfit > _GROSS * np.median(misfit) + ALREADY_ALIGNED


def registered(
    station: str,
    targets: np.ndarray,
    readings: np.ndarray,
    motion: Callable[[np.ndarray, np.ndarray, str], tuple[np.ndarray, np.ndarray]],
) -> dict[str, float]:
    """Numbers of a station by their keys, from the `motion` of targets (K, 3), m, to readings (K, 3), m.

    Where these already agree to a centimetre, the station stays at the base frame.
    """
    if np.median(np.linalg.norm(readings - targets, axis=1)) < ALREADY_ALIGNED:
        return dict.fromkeys(STATION, 0.0)
    kept = _consistent(targets, readings)
    rotation, offset = motion(targets[kept], readings[kept], station)
    numbers = zip(STATION, (*offset, *rotation_vector(rotation)), strict=True)
    return {key: float(value) for key, value in numbers}


def _consistent(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Mask (N,) of the points whose distances to most others are the same in both sets, so that no gross outlier turns the frame."""
    some = np.linspace(0, len(source) - 1, min(len(source), _REFERENCES)).astype(int)
    misfit = np.median(np.abs(_distances(target, some) - _distances(source, some)), axis=1)
    kept = ~wrong_readings(misfit)
    return kept if kept.sum() >= _FEWEST else np.ones(len(source), dtype=bool)


def _distances(points: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Distances (N, k), m, of points (N, 3) from those with some of their indices (k,), to a tenth of a micrometre."""
    centred = points - points.mean(axis=0)
    squares = np.sum(centred**2, axis=1)
    return np.sqrt(np.maximum(squares[:, None] + squares[some] - 2 * centred @ centred[some].T, 0.0))


def rigid_motion(source: np.ndarray, target: np.ndarray, name: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Rigid motion that maps points onto others with the least sum of squared distances (Kabsch 1976).

    Parameters
    ----------
    source, target : ndarray
        Corresponding points (N, 3), m.
    name : str
        What the points are, for the message of the error.

    Returns
    -------
    rotation : ndarray
        Rotation matrix (3, 3).
    translation : ndarray
        Translation (3,), m: ``target ≈ source @ rotation.T + translation``.

    Raises
    ------
    FlexcalError
        Where the points do not span a plane.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import rigid_motion
    >>> source = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> rotation, translation = rigid_motion(source, source + [1, 2, 3])
    >>> np.allclose(rotation, np.eye(3))
    True
    >>> translation.round(6)
    array([1., 2., 3.])
    """
    left, sizes, right = _correlation(source, target, name)
    if sizes[1] < 1e-9 * max(sizes[0], 1e-12):
        spread = np.linalg.svd(target - np.mean(target, axis=0), compute_uv=False)
        where = "as measured" if spread[1] < 1e-4 * max(spread[0], 1e-12) else "by the robot's model alone"
        raise FlexcalError(
            "E-CAL-016",
            f"the points of station '{name}' lie on a line {where}; measure poses distributed in space, or correct the robot's URDF.",
        )
    return _motion(source, target, left, right)


def best_motion(source: np.ndarray, target: np.ndarray, name: str = "") -> tuple[np.ndarray, np.ndarray]:
    """One of the rigid motions of `rigid_motion` for points (N, 3) that may lie on a line, or in one place, as sockets of a fixture do.

    Raises `FlexcalError` for fewer than three points.
    """
    left, _, right = _correlation(source, target, name)
    return _motion(source, target, left, right)


def _correlation(
    source: np.ndarray, target: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if len(source) < LEAST_REGISTERED:
        raise FlexcalError(
            "E-CAL-015",
            f"station '{name}' has {len(source)} poses; at least {LEAST_REGISTERED} are needed to register it.",
        )
    return np.linalg.svd((target - target.mean(axis=0)).T @ (source - source.mean(axis=0)))


def _motion(
    source: np.ndarray, target: np.ndarray, left: np.ndarray, right: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    from_centre, to_centre = source.mean(axis=0), target.mean(axis=0)
    sign = np.sign(np.linalg.det(left @ right))
    rotation = left @ np.diag([1.0, 1.0, sign]) @ right
    return rotation, to_centre - rotation @ from_centre
