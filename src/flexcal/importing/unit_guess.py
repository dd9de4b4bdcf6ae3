"""Units by magnitude: angles against the joints' limits, points against the reach, time against rates of logging."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flexcal.model import RobotModel

_OVER = 0.05
"""A joint may be past its limits by this share of its range: limits of URDFs are rounded, and some robots go past them."""
_LARGEST = 4.0
"""Points of one target lie within so many times the reach of their middle."""
_SLOWEST_IN_MS = 110.0


def joint_unit(model: RobotModel, joint: int, values: np.ndarray) -> str:
    """The unit of a joint's positions (N,): rad (m) where all are within its limits, which some robots pass a little, else deg (mm)."""
    kind = model.joints[joint]
    units = {"m": 1.0, "mm": 1e-3} if kind.kind == "prismatic" else {"rad": 1.0, "deg": np.pi / 180}
    lower = kind.lower if np.isfinite(kind.lower) else -2 * np.pi
    upper = kind.upper if np.isfinite(kind.upper) else 2 * np.pi
    room = _OVER * (upper - lower)
    finite = values[np.isfinite(values)]
    first, second = units
    within = (finite >= lower - room) & (finite <= upper + room)
    return first if within.all() else second


def shared_joint_units(model: RobotModel, q: np.ndarray) -> tuple[str, ...]:
    """The unit of every column of joint positions (N, n); revolute joints have one, for no file mixes degrees and radians."""
    found = [joint_unit(model, i, q[:, i]) for i in range(model.n)]
    revolute = "deg" if "deg" in found else "rad"
    slides = "mm" if "mm" in found else "m"
    return tuple(slides if joint.kind == "prismatic" else revolute for joint in model.joints)


def point_unit(model: RobotModel, xyz: np.ndarray) -> str:
    """The unit of points (N, 3): metres where they fit into a few times the reach, else millimetres or micrometres."""
    spread = float(np.nanmax(np.linalg.norm(xyz - np.nanmedian(xyz, axis=0), axis=1), initial=0.0))
    for unit, factor in (("m", 1.0), ("mm", 1e-3)):
        if spread * factor <= _LARGEST * max(model.reach, 0.1):
            return unit
    return "um"


def time_unit(t: np.ndarray) -> str:
    """The unit of time stamps (N,) by their usual step: seconds from once a second on, milliseconds from ten times a second on, else us."""
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    return "s" if step <= 1.1 else "ms" if step <= _SLOWEST_IN_MS else "us"
