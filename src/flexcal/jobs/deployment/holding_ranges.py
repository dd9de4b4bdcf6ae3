"""Joint ranges within which a calibration holds."""

from __future__ import annotations

import numpy as np

from flexcal.export import drawing_limits
from flexcal.jobs.inputs import CalibratedRobot, beyond_calibration
from flexcal.model.robot import RobotModel

_POSES = 1000
"""Random poses at which the calibration must hold."""
_STEPS = 4
"""Steps in which a range grows to the joint's own."""


def calibrated_ranges(robot: CalibratedRobot, model: RobotModel) -> np.ndarray | None:
    """Lower and upper ends (2, n), rad or m, of the joints at the poses of the calibration; None if unknown."""
    known = robot.blocks["calibration"].ranges if "calibration" in robot.blocks else {}
    if not all(name in known for name in model.motor_names):
        return None
    return np.array([known[name] for name in model.motor_names]).T


def holding_ranges(robot: CalibratedRobot, model: RobotModel) -> dict[str, np.ndarray]:
    """Joint ranges (2, n), rad or m, within which the calibration holds, by the points of `model` at which it does not everywhere.

    The predicted error is not above three times that near the calibrated poses at any of 1000 random poses within them. They are the
    joints' ranges at the poses of the calibration, grown towards what the joints can as far as that is so, or, where it is not even
    there, shrunk towards their middle. Where a joint has all that it can they are infinite.
    """
    inside = calibrated_ranges(robot, model)
    if inside is None:
        return {}
    rng, middle = np.random.default_rng(0), inside.mean(axis=0)
    (low, high), (lower, upper) = inside, drawing_limits(model)
    whole = np.array([np.minimum(low, lower), np.maximum(high, upper)])

    def ends(shares: np.ndarray) -> np.ndarray:
        """Of ranges from the middle, -1, over those of the calibration, 0, to what the joints can, 1."""
        near = middle + (1 + np.minimum(shares, 0)) * (inside - middle)
        return near + np.maximum(shares, 0) * (whole - near)

    def holds(shares: np.ndarray, point: str) -> bool:
        lowest, highest = ends(shares)
        q = rng.uniform(lowest, highest, (_POSES, model.n))
        return not beyond_calibration(robot, q, np.full(_POSES, point)).any()

    found = {}
    for point in model.points:
        if holds(np.ones(model.n), point):
            continue
        shares = np.zeros(model.n) if holds(np.zeros(model.n), point) else np.full(model.n, -1.0)
        growing = True
        while growing:
            growing = False
            for joint in range(model.n):
                grown = shares.copy()
                grown[joint] = min(grown[joint] + 1 / _STEPS, 1)
                if grown[joint] > shares[joint] and holds(grown, point):
                    shares, growing = grown, True
        found[point] = np.where(shares == 1, [[-np.inf], [np.inf]], ends(shares))
    return found
