"""Kinetic and potential energy as a linear map of the links' inertial parameters (Gautier & Khalil 1988)."""

from __future__ import annotations

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_batch
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import RobotModel
from flexcal.model.torques.inertial_regressor import torque_regressor


def energy_regressor(model: RobotModel, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Energy regressor H (samples, 10 n), J, with H · `inertial_parameters` = ½ q̇ᵀM q̇ + U; U is zero with all masses in the base origin.

    `q`, `dq` (samples, n) in rad, m and s; columns are named by `inertial_names`. No acceleration stands in it. The model's geometric
    errors count; deflections and the payload do not. Raises `FlexcalError` where the shapes differ or do not fit the robot.
    """
    q, dq = joint_batch(model, q), joint_batch(model, dq)
    if q.shape != dq.shape:
        raise FlexcalError(
            "E-MODEL-009", f"q and dq have shapes {q.shape} and {dq.shape}; give as many samples of each."
        )
    geometry, still = np.ascontiguousarray(model.geometry.errors), np.zeros((*q.shape, 3))
    rest = np.zeros_like(q)
    momentum = torque_regressor(model, q, rest, dq) - torque_regressor(model, q, rest, rest)  # M q̇
    energy = 0.5 * np.einsum("sj,sjk->sk", dq, momentum)
    for joint in range(model.n):
        origin = -geometry[joint, 3:]  # the length errors of a joint lie beyond its link's frame
        position, orientation, _, _ = model.tree.point(
            joint, np.eye(3), np.zeros(3), origin, geometry, np.zeros(6), q, still, False
        )
        first = len(LINK_PARAMETERS) * joint
        energy[:, first] -= position @ model.gravity
        energy[:, first + 1 : first + 4] -= np.einsum("i,sij->sj", model.gravity, orientation)
    return energy
