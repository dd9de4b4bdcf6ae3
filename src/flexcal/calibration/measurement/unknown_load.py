"""Deflection of an arm by a load of which neither the mass nor what the joints yield to it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.measurement.prediction import PredictedMeasurements
from flexcal.model.parts import Payload
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque

_YIELD = 1e-6
"""Compliance of a joint, rad/(N m), in a unit of the columns."""


def with_load_at(model: RobotModel, target: str) -> RobotModel:
    """The robot with a payload without mass at a point on the tool, where it declares none."""
    if model.payload is not None:
        return model
    point = model.points[target]
    payload = Payload(
        point.frame,
        point.joint,
        point.rotation,
        point.translation,
        0.0,
        0.0,
        0.0,
        point.xyz,
        np.zeros((3, 3)),
    )
    return replace(model, payload=payload)


def sag_columns(model: RobotModel, at: PredictedMeasurements) -> np.ndarray:
    """Displacements (3 K, n) of predicted points by what each revolute joint yields to the payload's torque, per kg and µrad/(N m)."""
    torque = gravity_torque(model, at.poses.q, 1.0) - gravity_torque(model, at.poses.q, 0.0)
    joints = [joint for joint in model.motor_joints if joint.kind == "revolute"]
    each = at.jacobian([f"{joint.name}.offset" for joint in joints]).reshape(3 * len(at.poses), len(joints))
    yields = -torque[:, [model.joint_index(joint.name) for joint in joints]]
    return _YIELD * each * np.repeat(yields, 3, axis=0)
