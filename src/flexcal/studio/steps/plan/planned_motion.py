"""A planned motion against the limits of the robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.plans import MultisinePlan, TrajectoryPlan
from flexcal.design.trajectories import (
    BaseRegressor,
    MotionLimits,
    require_stated_limits,
    with_assumed_friction,
)
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic import excitation_torque, reference_trajectory
from flexcal.model.robot import RobotModel

_INSTANTS = 500
"""Instants of a trajectory's period, or of an experiment."""
_UNITS = {
    "position": "of its range",
    "velocity": "of its velocity limit",
    "acceleration": "of its acceleration limit",
}


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """Motion of an n-joint robot at N instants.

    Attributes
    ----------
    joints : tuple of str
        Names of the joints.
    time : ndarray
        Instants (N,), s.
    q : ndarray
        Joint positions (N, n), rad or m.
    shares : mapping of ndarray
        Fractions (N, n) of the limits that are used: position from −1 to 1 in its range, velocity, acceleration where it is limited,
        torque where masses and efforts are stated.
    """

    joints: tuple[str, ...]
    time: np.ndarray
    q: np.ndarray
    shares: Mapping[str, np.ndarray]

    @cached_property
    def largest(self) -> dict[str, tuple[float, str, float]]:
        """Largest fraction of each limit, the joint and the instant, s, where it is used."""
        found = {}
        for quantity, shares in self.shares.items():
            size = np.abs(np.nan_to_num(shares))
            instant, joint = np.unravel_index(int(size.argmax()), size.shape)
            found[quantity] = (float(size[instant, joint]), self.joints[joint], float(self.time[instant]))
        return found


class MotionJudge:
    """What motions take of the limits of a robot; raises `FlexcalError` for limits that cross."""

    def __init__(self, model: RobotModel, payload: float | None):
        self.model = model
        self.limits = MotionLimits.of(model)
        self.lacking = ""
        self._columns: BaseRegressor | None = None
        try:
            require_stated_limits(model)
        except FlexcalError as problem:
            self.lacking = str(problem)
            return
        self._columns = BaseRegressor.of(with_assumed_friction(model)[0], payload)

    def of(self, time: np.ndarray, motion: np.ndarray, extra: np.ndarray | None = None) -> PlannedMotion:
        """A motion q, q̇, q̈ (3, N, n) at `time` (N,), s, with torques `extra` (N, n), N m, added to those that it takes."""
        limits = self.limits
        if self._columns is None:
            q, dq, _ = motion
            half, middle = (limits.upper - limits.lower) / 2, (limits.upper + limits.lower) / 2
            shares = {"position": (q - middle) / half, "velocity": dq / limits.velocity}
        else:
            shares = limits.shares(motion, self._columns)
            if extra is not None:
                shares["torque"] = shares["torque"] + extra / limits.torque
        return PlannedMotion(tuple(self.model.joint_names), time, motion[0], shares)


def trajectory_motions(judge: MotionJudge, plan: TrajectoryPlan) -> dict[str, PlannedMotion]:
    """One period of every trajectory, by its number."""
    time = np.linspace(0.0, 1 / plan.base_frequency_hz, _INSTANTS + 1)
    return {
        str(number + 1): judge.of(time, np.array(plan.motion(number, time))) for number in range(len(plan))
    }


def frequency_motions(judge: MotionJudge, plan: MultisinePlan) -> dict[str, PlannedMotion]:
    """The reference motion about every pose over two periods of the excitation, by the pose's number.

    Torques are those of the reference with the largest excitation of any experiment within each interval between instants; the vibration
    that the excitation causes is not part of the motion.
    """
    time = np.linspace(0.0, 2 / plan.base_frequency_hz, _INSTANTS + 1)
    reference = np.zeros((3, len(time), plan.joint_count))
    for k, course in enumerate(reference_trajectory(plan, time)):
        reference[k][:, plan.joints] = course[:, None]
    extra = np.zeros((len(time), plan.joint_count))
    extra[:, plan.joints] = _peaks(plan, len(time))
    motions = {}
    for number, pose in enumerate(plan.poses, start=1):
        motion = reference.copy()
        motion[0] += pose
        motions[str(number)] = judge.of(time, motion, extra)
    return motions


def _peaks(plan: MultisinePlan, instants: int) -> np.ndarray:
    """Excitation torque (instants, n_u), N m, over two periods: in each interval the largest, with its sign, of all experiments."""
    largest = np.zeros((instants, plan.experiments))
    for realisation in range(plan.realisations):
        for experiment in range(plan.experiments):
            twice = np.tile(excitation_torque(plan, realisation, experiment), (2, 1))
            for k, part in enumerate(np.array_split(twice, instants)):
                peak = part[np.abs(part).argmax(axis=0), np.arange(plan.experiments)]
                largest[k] = np.where(np.abs(peak) > np.abs(largest[k]), peak, largest[k])
    return largest


def limit_sentence(motions: Mapping[str, PlannedMotion], word: str) -> tuple[str, bool]:
    """What all motions take of the limits, and whether they keep them; `word` is what a motion is called by its number."""
    worst = {
        quantity: max(
            ((motion.largest[quantity], label) for label, motion in motions.items()),
            key=lambda item: item[0][0],
        )
        for quantity in next(iter(motions.values())).shares
    }
    beyond = [
        f"{joint} takes {100 * share:.0f} % {_UNITS.get(quantity, 'of its effort')} in {word} {label} at {time:.2f} s"
        for quantity, ((share, joint, time), label) in worst.items()
        if share > 1 + _ROUNDING
    ]
    if beyond:
        return f"Beyond the limits: {'; '.join(beyond)}.", False
    used = ", ".join(
        f"{100 * share:.0f} % {quantity} ({joint})" for quantity, ((share, joint, _), _) in worst.items()
    )
    return f"All limits of the URDF and of robot.yaml are kept; at most {used}.", True


_ROUNDING = 1e-6
