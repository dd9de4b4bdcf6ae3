"""The box of joint configurations within a robot's limits."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics.following_joints import joint_positions
from flexcal.model.robot import RobotModel

_ATTEMPTS = 50
LIMIT_MARGIN = 0.02
"""Share of a joint's range that is left unused at either end."""


def joint_limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper limit (n,) of every joint with a motor, rad or m; infinite where there is none."""
    return np.array([joint.lower for joint in model.motor_joints]), np.array(
        [joint.upper for joint in model.motor_joints]
    )


def joint_ranges(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper end (n,) of every joint with a motor, rad or m, 2 % of the range inside its limits; a continuous joint turns ±π.

    Raises `FlexcalError` for limits that cross, or an unlimited prismatic joint.
    """
    lower, upper = joint_limits(model)
    for i, joint in enumerate(model.motor_joints):
        if lower[i] >= upper[i]:
            raise FlexcalError(
                "E-MODEL-002",
                f"the limits of {joint.name} in {model.urdf.name} cross ({lower[i]:g} to {upper[i]:g}); correct the URDF.",
            )
        if not np.isfinite(upper[i] - lower[i]):
            if joint.kind == "prismatic":
                raise FlexcalError(
                    "E-MODEL-003",
                    f"the prismatic {joint.name} has no limits in {model.urdf.name}; give it some.",
                )
            lower[i], upper[i] = -np.pi, np.pi
        else:
            free = LIMIT_MARGIN * (upper[i] - lower[i])
            lower[i], upper[i] = lower[i] + free, upper[i] - free
    return lower, upper


def random_configurations(
    model: RobotModel, count: int, rng: np.random.Generator, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Uniform random motor positions (count, n) between `lower` and `upper` (n,) at which all loops close.

    Raises `FlexcalError` where loops hardly ever close.
    """
    return _closing(model, count, lambda more: rng.uniform(lower, upper, (more, model.n)))


def low_discrepancy_configurations(model: RobotModel, count: int) -> np.ndarray:
    """Low-discrepancy sequence of configurations (count, n) over the joint ranges at which all loops close, the same at every call.

    The additive recurrence whose steps are powers of the generalised golden ratio, the root of x^(n+1) = x + 1.
    """
    ratio = 1.0
    for _ in range(60):
        ratio = (1 + ratio) ** (1 / (model.n + 1))
    steps = ratio ** -np.arange(1, model.n + 1)
    lower, upper = joint_ranges(model)
    counter = itertools.count()

    def further(more: int) -> np.ndarray:
        numbers = np.array(list(itertools.islice(counter, more)))
        return lower + (upper - lower) * ((0.5 + numbers[:, None] * steps) % 1.0)

    return _closing(model, count, further)


def _closing(model: RobotModel, count: int, further: Callable[[int], np.ndarray]) -> np.ndarray:
    if model.relations is None or not model.relations.loops:
        return further(count)
    q = np.zeros((0, model.n))
    for _ in range(_ATTEMPTS):
        tried = further(count)
        q = np.concatenate([q, tried[np.isfinite(joint_positions(model, tried)).all(axis=1)]])
        if len(q) >= count:
            return q[:count]
    names = ", ".join(loop.name for loop in model.relations.loops)
    raise FlexcalError(
        "E-MODEL-016",
        f"the loops {names} of {model.name} close at hardly any position within the limits of its motors; correct `loops:`, or the limits.",
    )
