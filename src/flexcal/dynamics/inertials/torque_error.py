"""Relative torque error of a robot on exciting trajectories."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.dynamics.inertials.bayesian_fit import CUTOFF_HZ
from flexcal.dynamics.inertials.linearised_equations import SAMPLES_PER_LINE, drive_rows
from flexcal.dynamics.signals import PeriodicMotion, real_rows
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import periodic_torque


@dataclass(frozen=True, eq=False)
class TrajectoryTorques:
    """`measured` and `predicted` torques of a trajectory: rows (2 K + 1, n), N m, of the Fourier series of its mean period up to 5 Hz."""

    measured: np.ndarray
    predicted: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """Measured minus predicted (2 K + 1, n), N m."""
        return self.measured - self.predicted


def trajectory_torques(
    model: RobotModel, plan: TrajectoryPlan, recordings: Iterable[Recording]
) -> tuple[TrajectoryTorques, ...]:
    """Measured torques of recorded trajectories, and those predicted by `model`.

    Friction that robot.yaml does not know counts as none. Raises `FlexcalError` where a recording does not fit the plan.
    """
    torques = []
    for number, recording in enumerate(recordings):
        motion = PeriodicMotion.of(recording, plan, number, CUTOFF_HZ)
        torques.append(TrajectoryTorques(real_rows(motion.torque), _torque(model, motion, plan.payload)))
    return tuple(torques)


def relative_torque_error(torques: Iterable[TrajectoryTorques]) -> float:
    """Norm of the residuals relative to that of the measured torques."""
    measured, missed = 0.0, 0.0
    for trajectory in torques:
        measured = measured + np.sum(trajectory.measured**2)
        missed = missed + np.sum(trajectory.residual**2)
    return float(np.sqrt(missed / measured))


def _torque(model: RobotModel, motion: PeriodicMotion, payload: float | None) -> np.ndarray:
    """Rows (2 K + 1, n) of the motor torques of a motion, as logged."""
    states = motion.states(SAMPLES_PER_LINE * motion.lines)
    torque = motion.rows(periodic_torque(model, *states, 1 / motion.base_frequency_hz, payload))
    for name, joint, rows in drive_rows(model, motion):
        torque[:, joint] += rows * np.nan_to_num(model.value(name))
    return torque / model.drives.drive_gain
