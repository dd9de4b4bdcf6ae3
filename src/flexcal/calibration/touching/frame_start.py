"""First estimate of a work object's frame from touches, by the construction that defines it; touches that define none are refused."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.kinds import rigid_motion
from flexcal.data.poses import FrameTouches
from flexcal.errors import FlexcalError

_LEAST_EXTENT = 2e-3
"""Distance of touches from a line, or from each other, m, below which they do not define a direction."""
_LEAST_RATIO = 0.02
"""The same, relative to the extent of the touches."""
_NEEDED = {"1": 3, "2": 2, "3": 1}


def frame_start(given: FrameTouches, tip: np.ndarray, outside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and origin (3,) of the work object's frame in the base frame, m.

    `tip` (N, 3) are the places of the tip, `outside` (3,) points from the first face to the side from which the tool came. Raises
    `FlexcalError` for too few touches, and for touches on a line.
    """
    names = given.touches.touched
    if given.method == "points":
        _require_points(names, given.known)
        return rigid_motion(given.known, tip)
    if given.method == "faces":
        return _from_faces(given, tip, outside)
    named = ("origin", "x", "xy") if given.method == "origin_x_xy" else ("x1", "x2", "y1")
    for name in named:
        if name not in names:
            raise FlexcalError(
                "E-TOOL-016",
                f"the point '{name}' was not touched; {', '.join(named[:2])} and {named[2]} are needed.",
            )
    first, second, third = (tip[names == name].mean(axis=0) for name in named)
    x = _direction(second - first, f"'{named[0]}' and '{named[1]}'")
    across = third - first - x * (x @ (third - first))
    y = _direction(across, f"'{named[2]}' and the line through '{named[0]}' and '{named[1]}'")
    origin = first if given.method == "origin_x_xy" else third - across
    return np.stack([x, y, np.cross(x, y)], axis=1), origin


def _from_faces(given: FrameTouches, tip: np.ndarray, outside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    one, two, three = (tip[given.touches.touched == name] for name in _NEEDED)
    for (name, least), touched in zip(_NEEDED.items(), (one, two, three), strict=True):
        if len(touched) < least:
            raise FlexcalError(
                "E-TOOL-017",
                f"face {name} was touched {len(touched)} times; 3 touches of face 1, 2 of face 2 and 1 of face 3 are needed at least.",
            )
    _require_plane(one, "the touches of face 1")
    z = np.linalg.svd(one - one.mean(axis=0))[2][2]
    z = z * (1.0 if z @ outside >= 0 else -1.0)
    along = two - two.mean(axis=0)
    along = along - np.outer(along @ z, z)
    x = np.linalg.svd(along)[2][0]
    x = x * np.sign(x @ (along[-1] - along[0]) or 1.0)
    _direction((along @ x).max() * x - (along @ x).min() * x, "the touches of face 2 along face 1")
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    return axes, axes @ [(three @ x).mean(), (two @ axes[:, 1]).mean(), (one @ z).mean()]


def tip_sides(given: FrameTouches, tip: np.ndarray, rotation: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Sign (3,), for every axis of the work object, of the side of a face on which the centre of a ball at the tip lies.

    The tip is above face 1. Side faces that were touched below it are those of a block, whose inside is where face 1 is; those that rise
    above it are walls, and face 1 is outside them.
    """
    at = (tip - origin) @ rotation
    faces = given.touches.touched
    middle = at[faces == "1"].mean(axis=0)
    sides = np.ones(3)
    for name, axis in (("2", 1), ("3", 0)):
        own = at[faces == name]
        inward = np.sign(middle[axis] - own[:, axis].mean()) or 1.0
        sides[axis] = inward if own[:, 2].mean() > middle[2] else -inward
    return sides


def _require_points(names: np.ndarray, known: np.ndarray) -> None:
    count = len(set(names.tolist()))
    if count < 3:
        raise FlexcalError(
            "E-TOOL-018",
            f"{count} different points were touched; at least 3 that are not on one line are needed, and 4 or more show wrong ones.",
        )
    _require_plane(known, "the points wx, wy, wz that were touched")


def _require_plane(points: np.ndarray, what: str) -> None:
    off = points - points.mean(axis=0)
    axis = np.linalg.svd(off)[2][0]
    extent, across = np.ptp(off @ axis), np.linalg.norm(off - np.outer(off @ axis, axis), axis=1).max()
    if across < max(_LEAST_EXTENT, _LEAST_RATIO * extent):
        raise FlexcalError(
            "E-TOOL-019",
            f"{what} lie on one line, to {across * 1e3:.2g} mm, so the rotation about it is not determined; touch one away from it.",
        )


def _direction(vector: np.ndarray, what: str) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if length < _LEAST_EXTENT:
        raise FlexcalError(
            "E-TOOL-020",
            f"{what} are {length * 1e3:.2g} mm apart, which defines no direction; touch them as far from each other as you can.",
        )
    return vector / length
