"""Poses within the joint ranges of two calibrations, and what moves their points in the base frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.calibration.measurement import PredictedMeasurements
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.model.kinematics import joint_limits, rigid_motion_columns
from flexcal.model.robot import RobotModel

_TURN = 2 * np.pi
"""Largest joint position, rad or m, of joints without a limit."""
_OVERLAP = 0.1
"""Least overlap of two ranges of a joint, rad or m."""


def common_ranges(model: RobotModel, estimates: Sequence[Estimate]) -> np.ndarray:
    """Lower and upper limits (2, n) of the motors, rad or m, that all calibrations cover.

    Raises `FlexcalError` where a joint was measured in ranges that hardly overlap.
    """
    limits = np.clip(joint_limits(model), -_TURN, _TURN)
    for k, name in enumerate(model.motor_names):
        ranges = [e.ranges[name] for e in estimates if name in e.ranges]
        own = np.array([*ranges, tuple(limits[:, k])])
        limits[:, k] = own[:, 0].max(), own[:, 1].min()
        widest = min((high - low for low, high in ranges), default=np.inf)
        if limits[1, k] - limits[0, k] < min(_OVERLAP, 0.5 * widest):
            told = " and ".join(f"{low:.3g} to {high:.3g}" for low, high in ranges)
            raise FlexcalError(
                "E-CAL-032",
                f"the two calibrations measured {name} in ranges that hardly overlap ({told}); measure again where the first did.",
            )
    return limits


def columns(at: PredictedMeasurements, names: Sequence[str]) -> np.ndarray:
    """Derivatives (3 N, p) of the points by the named parameters, in natural units."""
    return at.jacobian(names).reshape(3 * len(at.poses), len(names))


def rigid_motions(points: np.ndarray) -> np.ndarray:
    """Orthonormal basis (3 N, 6) of the displacements of points (N, 3) by small motions of the whole robot."""
    return np.linalg.qr(rigid_motion_columns(points - points.mean(axis=0)).reshape(-1, 6))[0]


def moving_names(model: RobotModel, estimates: Sequence[Estimate]) -> list[str]:
    """Names in any of the estimates that are the robot's own: not of stations, scatter, cameras and what is of one experiment."""
    known: Mapping[str, float] = model.values
    others = ("station.", "scatter.", "camera.", "sensor.", "force_sensor.")
    every = dict.fromkeys(name for e in estimates for name in e.parameters.names)
    return [
        name
        for name in every
        if name in known and not name.startswith(others) and not name.endswith(".scale")
    ]
