"""Units by magnitude: angles against the joints' limits, points against the reach, time against rates of logging."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.units import LARGEST

if TYPE_CHECKING:
    from flexcal.model.robot import InclinometerConfig, RobotModel

_OVER = 1.05
"""Tolerance by which robots exceed the limits in their URDF, which are often rounded."""
_NEARLY_ALL = 0.95
"""Share of the rows by which a unit is guessed, so that outliers do not change it."""
_LARGEST = 4.0
"""Largest distance of the points of one target from their middle, in units of the reach."""
_SLOWEST_IN_MS = 110.0
_LONGEST_AT_A_POSE = 1000.0
"""Longest time between measured poses, which takes seconds or minutes, s."""
_MOST_OF_GRAVITY, _RIGHT_ANGLE, _HALF_A_TURN = 1.5, 1.7, 3.3
"""Largest readings of inclinometers, of components and in rad."""


def joint_units(model: RobotModel, q: np.ndarray) -> tuple[str, ...]:
    """The unit of every column of joint positions (N, n): rad (m) where few are past the widest limit of all such joints, else deg (mm).

    A single joint's limits do not count: one that is counted the other way is past them in any unit.
    """
    kinds = np.array([joint.kind == "prismatic" for joint in model.motor_joints])
    chosen = {}
    for prismatic, (unit, other) in ((False, ("rad", "deg")), (True, ("m", "mm"))):
        values = np.abs(q[:, kinds == prismatic])
        values[~(values <= LARGEST)] = 0.0  # what no position can be, or none is, is refused later
        largest = float(np.quantile(values, _NEARLY_ALL, axis=0).max(initial=0.0))
        chosen[prismatic] = unit if largest <= _OVER * _widest(model, prismatic) else other
    return tuple(chosen[bool(prismatic)] for prismatic in kinds)


def _widest(model: RobotModel, prismatic: bool) -> float:
    """The largest limit (rad or m) of the joints of a kind; a joint without limits turns by 2π."""
    own = [joint for joint in model.motor_joints if (joint.kind == "prismatic") == prismatic]
    limits = [abs(limit) for joint in own for limit in (joint.lower, joint.upper)]
    return max((limit if np.isfinite(limit) else 2 * np.pi for limit in limits), default=0.0)


def point_unit(model: RobotModel, xyz: np.ndarray) -> str:
    """The unit of points (N, 3): metres where they fit into a few times the reach, else millimetres or micrometres."""
    xyz = xyz[(np.abs(xyz) <= LARGEST).all(axis=1)]  # what no point can be is refused later
    if not len(xyz):
        return "m"
    distance = np.linalg.norm(xyz - np.median(xyz, axis=0), axis=1)
    spread = float(np.nanquantile(distance, _NEARLY_ALL))
    for unit, factor in (("m", 1.0), ("mm", 1e-3)):
        if spread * factor <= _LARGEST * max(model.reach, 0.1):
            return unit
    return "um"


def tilt_unit(tilts: np.ndarray, declared: Sequence[InclinometerConfig]) -> str:
    """The unit of readings (N,) of an inclinometer, of one of those `declared`: rad or degrees, 1 or m/s² of components, by their size."""
    largest = float(np.nanmax(np.abs(tilts), initial=0.0))
    if declared and all(item.reads == "component" for item in declared):
        return "1" if largest <= _MOST_OF_GRAVITY else "m/s^2"
    half_turns = any(item.reads == "projection" for item in declared)
    return "rad" if largest <= (_HALF_A_TURN if half_turns else _RIGHT_ANGLE) else "deg"


def time_unit(t: np.ndarray) -> str:
    """The unit of time stamps (N,) by their usual step: seconds from once a second on, milliseconds from ten times a second on, else us."""
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    return "s" if step <= 1.1 else "ms" if step <= _SLOWEST_IN_MS else "us"


def pose_time_unit(t: np.ndarray) -> str:
    """The unit of the times (N,) at which poses were measured, by their usual step."""
    step = float(np.median(np.abs(np.diff(t)))) if len(t) > 1 else 1.0
    return "s" if step < _LONGEST_AT_A_POSE else "ms" if step < 1e3 * _LONGEST_AT_A_POSE else "us"
