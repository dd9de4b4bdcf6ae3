"""Joint torques of external loads: a measured wrench, and springs and cables that robot.yaml declares."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import joint_batch, joint_placement
from flexcal.model.parts import axis_rotations
from flexcal.model.robot import RobotModel


def wrench_torque(model: RobotModel, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Jᵀ w (samples, n), N m (N where prismatic): torques of the `wrench` (samples, 6) read by the force sensor, acting on the robot.

    `q` (samples, n) in rad or m; force (N), then moment about the sensor's origin (N m), in the sensor's axes. The joints before the
    sensor feel it, the others do not. Raises `AssertionError` for a robot without force sensor, and `FlexcalError` for another number of
    joints.
    """
    return np.einsum("snw,sw->sn", sensor_jacobian(model, q), wrench)


def sensor_jacobian(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Jᵀ (samples, n, 6): torques on the robot by each component that the force sensor reads; raises as `wrench_torque` does."""
    sensor = model.force_sensor
    assert sensor is not None
    q = joint_batch(model, q)
    rotation, position = np.eye(3), np.zeros(3)
    axes, origins = {}, {}
    carrying = model.path_to(sensor.joint)
    for i in carrying:
        offset, turn = joint_placement(model, i)
        position, rotation = position + rotation @ offset, rotation @ turn
        axis, moved = model.joints[i].axis, q[:, i] + model.geometry.errors[i, 0]
        axes[i], origins[i] = rotation @ axis, position
        if model.joints[i].kind == "prismatic":
            position = position + moved[:, None] * axes[i]
        else:
            rotation = rotation @ axis_rotations(axis, moved)
    place = position + rotation @ sensor.translation
    rotation = sensor.sign * (rotation @ sensor.rotation)
    jacobian = np.zeros((*q.shape, 6))
    for i in carrying:
        along = np.matmul(np.broadcast_to(axes[i], place.shape)[:, None], rotation)[:, 0]
        if model.joints[i].kind == "prismatic":
            jacobian[:, i, :3] = along
        else:
            lever = np.cross(axes[i], place - origins[i])
            jacobian[:, i, :3], jacobian[:, i, 3:] = np.matmul(lever[:, None], rotation)[:, 0], along
    return jacobian


def declared_torque(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Torque (samples, n) that springs and cables with declared values exert on the joints, opposite to what the motors give for them."""
    torque = np.zeros_like(q)
    for spring in model.config.dynamics.joint_springs:
        joint = model.joint_index(spring.joint)
        if spring.stiffness is not None:
            torque[:, joint] -= spring.stiffness * (q[:, joint] - (spring.rest or 0.0))
    for cable in model.config.dynamics.cable_torques:
        torque[:, model.joint_index(cable.joint)] -= cable.torque or 0.0
    return torque
