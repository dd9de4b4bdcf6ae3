"""Joint torques as a linear map of the links' inertial parameters (Eq. 2.20 of the thesis)."""

from __future__ import annotations

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_batch
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import RobotModel


def inertial_names(model: RobotModel) -> tuple[str, ...]:
    """Names of the 10 n columns, link by link in chain order."""
    return tuple(f"{joint.link}.{key}" for joint in model.joints for key in LINK_PARAMETERS)


def torque_regressor(model: RobotModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque regressor W (samples, n, 10 n): W · `inertial_parameters` = torques that move the links, gravity included.

    `q`, `dq`, `ddq` (samples, n) in rad, m and s. Rows are N m (N where prismatic); columns are named by `inertial_names`. Column
    10 i + k of joint j is zero where link i is not beyond joint j. In memory the samples of one column follow each other, which is
    what filters along time want. The model's geometric errors count; deflections and the payload do not.
    Raises `FlexcalError` where the shapes differ or do not fit the robot.
    """
    q = joint_batch(model, q)
    shape = (model.n, len(LINK_PARAMETERS) * model.n)
    regressor = np.zeros((shape[0] * shape[1], len(q)))
    write_torque_regressor(model, q, dq, ddq, np.arange(len(regressor)).reshape(shape), regressor)
    return regressor.reshape(*shape, len(q)).transpose(2, 0, 1)


def write_torque_regressor(
    model: RobotModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, places: np.ndarray, out: np.ndarray
) -> None:
    """Write selected columns of `torque_regressor` below each other: column c of joint j becomes row `places`[j, c] of `out`.

    `places` (n, 10 n) is -1 for what is not needed; `out` is (rows, samples). Entries that are zero because link i is not beyond joint j
    are not written. Raises `FlexcalError` as that does.
    """
    q, dq, ddq = motion_batch(model, q, dq, ddq)
    geometry = np.ascontiguousarray(model.geometry.errors)
    model.tree.torque_regressor(geometry, model.gravity, q, dq, ddq, places, out)


def motion_batch(
    model: RobotModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration as contiguous (samples, n) arrays; raises `FlexcalError` for shapes that differ or do not fit
    the robot.
    """
    model.require_motors("torques of dynamics")
    q, dq, ddq = (joint_batch(model, values) for values in (q, dq, ddq))
    if not q.shape == dq.shape == ddq.shape:
        raise FlexcalError(
            "E-MODEL-010",
            f"q, dq and ddq have shapes {q.shape}, {dq.shape} and {ddq.shape}; give as many samples of each.",
        )
    return q, dq, ddq


def inertial_parameters(model: RobotModel) -> np.ndarray:
    """Inertial parameters of the model (10 n,), in the order of the columns."""
    values = model.values
    return np.array([values[name] for name in inertial_names(model)])
