"""The box of joint configurations within a robot's limits."""

from __future__ import annotations

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel

LIMIT_MARGIN = 0.02
"""Share of a joint's range that is left unused at either end."""


def joint_limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper limit (n,) of every joint, rad or m; infinite where there is none."""
    return np.array([joint.lower for joint in model.joints]), np.array(
        [joint.upper for joint in model.joints]
    )


def joint_ranges(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper end (n,) of every joint, rad or m, 2 % of the range inside its limits; a continuous joint turns ±π.

    Raises `FlexcalError` for limits that cross, or an unlimited prismatic joint.
    """
    lower, upper = joint_limits(model)
    for i, joint in enumerate(model.joints):
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


def low_discrepancy_configurations(model: RobotModel, count: int) -> np.ndarray:
    """Low-discrepancy sequence of configurations (count, n) over the joint ranges, the same at every call.

    The additive recurrence whose steps are powers of the generalised golden ratio, the root of x^(n+1) = x + 1.
    """
    ratio = 1.0
    for _ in range(60):
        ratio = (1 + ratio) ** (1 / (model.n + 1))
    steps = ratio ** -np.arange(1, model.n + 1)
    lower, upper = joint_ranges(model)
    return lower + (upper - lower) * ((0.5 + np.arange(count)[:, None] * steps) % 1.0)
