"""External joint torques of a recording: τ_ext of Eqs. (2.20) and (2.21)."""

from __future__ import annotations

import numpy as np

from flexcal.data.recordings import Recording
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel
from flexcal.model.torques import declared_torque, wrench_torque


def external_torque(model: RobotModel, recording: Recording) -> np.ndarray | None:
    """External torque τ_ext (N, n), N m, on the joints in addition to the motors; None if nothing is measured or known.

    It is the sum of the wrench at the force sensor (Jᵀ w, on the arm side where that was measured) and of springs and cables whose size
    robot.yaml declares. Columns `tau_ext` are not used: most are the controller's own estimate, from its model of the robot. Raises
    `InputError` for a wrench without `force_sensor:`, or in part.
    """
    q = recording.q if recording.arm is None else _behind(model, recording.q, recording.arm)
    parts = []
    if recording.force is not None or recording.moment is not None:
        parts.append(wrench_torque(model, q, _wrench(model, recording)))
    known = declared_torque(model, q)
    if known.any():
        parts.append(known)
    return sum(parts[1:], parts[0]) if parts else None


def _wrench(model: RobotModel, recording: Recording) -> np.ndarray:
    if model.force_sensor is None:
        raise InputError(
            "E-DYN-031",
            f"{recording.name}: there are columns of a force sensor, but {model.path.name} declares none; add "
            "'force_sensor: {frame: FRAME, wrench: on_robot}' (or on_environment, for what the robot does to its surroundings), "
            "or remove the columns.",
        )
    if recording.force is None or recording.moment is None:
        lacking = "fx, fy, fz" if recording.force is None else "mx, my, mz"
        raise InputError(
            "E-DYN-032",
            f"{recording.name}: the columns {lacking} are missing beside the others of the force sensor; add them (zeros only where "
            "there are none).",
        )
    return np.hstack([recording.force, recording.moment])


def _behind(model: RobotModel, motors: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Positions (N, n) on the arm side of elastic joints, else of the motors."""
    elastic = np.isin(np.arange(model.n), [joint.index for joint in model.elastic])
    return np.where(elastic, arm, motors)
