"""Joint torques of what acts on a robot beside its motors: a measured wrench, and springs and cables that robot.yaml knows."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import joint_batch
from flexcal.model.placement import joint_placement
from flexcal.model.robot_model import RobotModel


def wrench_torque(model: RobotModel, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Jᵀ w (samples, n), N m (N where prismatic): torques of the `wrench` (samples, 6) read by the force sensor, acting on the robot.

    `q` (samples, n) in rad or m; force (N), then moment about the sensor's origin (N m), in the sensor's axes. The joints before the
    sensor feel it, the others do not. Raises `AssertionError` for a robot without force sensor, and `FlexcalError` for another number of
    joints.
    """
    sensor = model.force_sensor
    assert sensor is not None
    q = joint_batch(model, q)
    carrying, joint = [], sensor.joint
    while joint >= 0:
        carrying.insert(0, joint)
        joint = model.joints[joint].parent
    rotation, position = np.eye(3)[None], np.zeros((1, 3))
    axes, origins = {}, {}
    for i in carrying:
        offset, turn = joint_placement(model, i)
        position, rotation = position + rotation @ offset, rotation @ turn
        axis, moved = model.joints[i].axis, q[:, i] + model.geometry[i, 0]
        axes[i], origins[i] = rotation @ axis, position
        if model.joints[i].kind == "prismatic":
            position = position + moved[:, None] * axes[i]
        else:
            rotation = rotation @ _turns(axis, moved)
    place = position + rotation @ sensor.translation
    rotation = sensor.sign * (rotation @ sensor.rotation)
    force, moment = (np.einsum("sij,sj->si", rotation, part) for part in (wrench[:, :3], wrench[:, 3:]))
    found = np.zeros_like(q)
    for i in carrying:
        if model.joints[i].kind == "prismatic":
            found[:, i] = np.sum(axes[i] * force, axis=1)
        else:
            found[:, i] = np.sum(axes[i] * (moment + np.cross(place - origins[i], force)), axis=1)
    return found


def declared_torque(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Torque (samples, n) of springs and cables on the joints, as far as robot.yaml says how much: less what motors give against it."""
    found = np.zeros_like(q)
    for spring in model.config.dynamics.joint_springs:
        joint = model.joint_index(spring.joint)
        if spring.stiffness is not None:
            found[:, joint] -= spring.stiffness * (q[:, joint] - (spring.rest or 0.0))
    for cable in model.config.dynamics.cable_torques:
        found[:, model.joint_index(cable.joint)] -= cable.torque or 0.0
    return found


def _turns(axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Rotations (samples, 3, 3) about a unit `axis` (3,) by `angles` (samples,): Rodrigues."""
    cross = np.cross(np.eye(3), axis[None])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)
