"""Poses at which gravity preloads every backlash with a margin."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import low_discrepancy_configurations
from flexcal.model.robot import RobotModel
from flexcal.model.statics import certain_flank, gravity_torque

LEAST_TORQUE = 10.0
"""Gravity torque, N m, below which a backlash does not count as preloaded."""
LEAST_SHARE = 0.05
"""Share of the largest gravity torque of the joint below which a backlash does not count as preloaded."""

BLOCK = 512
"""Number of poses whose torques are evaluated together, sized for the processor's cache."""


def preload_joints(model: RobotModel) -> tuple[int, ...]:
    """Revolute joints declared to have backlash."""
    return tuple(i for i in model.backlash_joints if model.joints[i].kind == "revolute")


def preloaded(model: RobotModel, q: np.ndarray, payload: float | None = None) -> np.ndarray:
    """Mask (samples,) of configurations `q` (samples, n) with a certain flank of every backlash.

    The sign of its torque must be certain; and the torque must exceed 10 N m and 5 % of its largest over the joint ranges.
    """
    joints = list(preload_joints(model))
    if not joints or not len(q):
        return np.ones(len(q), dtype=bool)
    largest = np.abs(gravity_torque(model, low_discrepancy_configurations(model, 1000), payload))[
        :, joints
    ].max(axis=0)
    least = np.maximum(LEAST_TORQUE, LEAST_SHARE * largest)
    torque = gravity_torque(model, q, payload)
    sure = np.all(np.abs(torque[:, joints]) > least, axis=1)
    large = np.flatnonzero(sure)
    for first in range(0, len(large), BLOCK):
        part = large[first : first + BLOCK]
        sure[part] = np.all(certain_flank(model, q[part], torque[part], payload)[:, joints], axis=1)
    return sure
