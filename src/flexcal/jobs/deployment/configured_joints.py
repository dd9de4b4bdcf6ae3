"""Joint positions of a pose with the configuration that a program writes."""

from __future__ import annotations

import itertools

import numpy as np

from flexcal.compensation import ToolPoseTarget, nominal_joint_positions
from flexcal.jobs.deployment.arm_postures import arm_postures
from flexcal.jobs.deployment.controller_joints import ControllerJoints
from flexcal.model.kinematics import joint_limits, low_discrepancy_configurations

_STARTS = 96
"""Starts of inverse kinematics over the joint ranges: a six-joint arm has up to 8, in general 16 solutions."""

_EQUAL = 1e-6
"""Difference (rad) between distances from a written configuration that is only rounding."""


def fitting_joints(
    joints: ControllerJoints, words: tuple[str, ...], solutions: np.ndarray, near: np.ndarray
) -> np.ndarray | None:
    """That of the solutions (N, 6), whole turns added to their joints, nearest to the written configuration; None where none is near it.

    Of several it is the nearest to `near` (6,).
    """
    configuration = joints.dialect.configuration
    assert configuration is not None
    turned = whole_turns(joints, solutions)
    if not len(turned):
        return None
    distances = np.array([configuration.distance(posture, words) for posture in arm_postures(joints, turned)])
    if not np.isfinite(distances).any():
        return None
    kept = turned[distances <= distances.min() + _EQUAL]
    return kept[np.argmin(np.abs(kept - near).max(axis=1))]


def all_solutions(joints: ControllerJoints, aim: ToolPoseTarget) -> np.ndarray:
    """Joint positions (N, 6) of the nominal robot at the one pose of `aim`, as found from starts over the joint ranges."""
    starts = low_discrepancy_configurations(joints.nominal, _STARTS)
    several = ToolPoseTarget(*(np.repeat(part, len(starts), axis=0) for part in _parts(aim)))
    found, reasons = nominal_joint_positions(joints.nominal, several, starts)
    return found[np.array([not reason for reason in reasons])]


def whole_turns(joints: ControllerJoints, solutions: np.ndarray) -> np.ndarray:
    """The solutions (N, 6), and those that differ by whole turns of revolute joints within the limits."""
    lower, upper = joint_limits(joints.nominal)
    turns = np.array(
        [0.0 if joint.kind == "prismatic" else 2 * np.pi for joint in joints.nominal.motor_joints]
    )
    several = []
    for q in solutions:
        ranges = []
        for value, turn, low, high in zip(q, turns, lower, upper, strict=True):
            most = 2 if np.isfinite(high - low) else 1
            other = [value + k * turn for k in range(-most, most + 1) if k] if turn else []
            ranges.append([value, *(each for each in other if low <= each <= high)])
        several += list(itertools.product(*ranges))
    return np.array(several).reshape(-1, 6)


def _parts(aim: ToolPoseTarget) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    assert aim.rotation is not None
    return aim.target, aim.position, aim.rotation
