"""Relative torque error of a robot on exciting trajectories."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.dynamics.inertials.bayesian_fit import CUTOFF_HZ
from flexcal.dynamics.inertials.linearised_equations import SAMPLES_PER_LINE, drive_rows
from flexcal.dynamics.signals import PeriodicMotion, real_rows
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import periodic_torque


def trajectory_error(model: RobotModel, plan: TrajectoryPlan, recordings: Iterable[Recording]) -> float:
    """Relative torque error of `model` on recorded trajectories, up to 5 Hz as in `identify_with_prior`.

    Friction that robot.yaml does not know counts as none. Raises `FlexcalError` where a recording does not fit the plan.
    """
    measured, missed = 0.0, 0.0
    for number, recording in enumerate(recordings):
        motion = PeriodicMotion.of(recording, plan, number, CUTOFF_HZ)
        seen = real_rows(motion.torque)
        left = seen - _torque(model, motion, plan.payload)
        measured, missed = measured + np.sum(seen**2), missed + np.sum(left**2)
    return float(np.sqrt(missed / measured))


def _torque(model: RobotModel, motion: PeriodicMotion, payload: float | None) -> np.ndarray:
    """Rows (2 K + 1, n) of the motor torques that a motion needs."""
    states = motion.states(SAMPLES_PER_LINE * motion.lines)
    torque = motion.rows(periodic_torque(model, *states, 1 / motion.base_frequency_hz, payload))
    for name, joint, rows in drive_rows(model, motion):
        torque[:, joint] += rows * np.nan_to_num(model.value(name))
    return torque
