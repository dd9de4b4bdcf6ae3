"""Feed-forward of the virtual cell's controller: inverse dynamics of the controller's robot model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.model.robot import Links, RobotModel, carried_inertias
from flexcal.model.torques import inertial_parameters, torque_regressor
from flexcal.virtual_cell.config import CellConfig
from flexcal.virtual_cell.plant import Plant, gravity_stiffness, linearise


def inverse_dynamics(
    plant: Plant, position: np.ndarray, motion: np.ndarray, rate: np.ndarray, acceleration: np.ndarray
) -> np.ndarray:
    """Motor torque (N, m) N m that moves the rigid arm about `position` (d,) by `motion`, `rate`, `acceleration`, each (N, m).

    Linear in the motion (rad, rad/s, rad/s²), which stays small; with viscous and Coulomb friction.
    """
    import mujoco

    motors = plant.motors
    linear = linearise(plant, position)
    tangent = gravity_stiffness(plant, mujoco.MjData(plant.mjmodel), position)[np.ix_(motors, motors)]
    viscous, coulomb, smoothing = plant.frictions[:, :3].T
    inertial = acceleration @ linear.mass[np.ix_(motors, motors)] + motion @ tangent.T
    return linear.gravity[motors] + inertial + viscous * rate + coulomb * np.tanh(rate / smoothing)


def rigid_inverse_dynamics(
    model: RobotModel,
    config: CellConfig,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    payload: float | None = None,
) -> np.ndarray:
    """Motor torque (N, n) N m that moves the rigid robot by any motion `q`, `dq`, `ddq` (N, n), with friction.

    `payload` in kg, None for the declared.
    """
    bodies = carried_inertias(model, payload)
    loaded = replace(model, links=Links.of(bodies))
    links = torque_regressor(loaded, q, dq, ddq) @ inertial_parameters(loaded)
    rotor, viscous, coulomb = np.nan_to_num(
        [model.drives.rotor_inertia, model.drives.viscous, model.drives.coulomb]
    )
    scale, smoothing = config.friction.scale, config.friction.coulomb_velocity
    return links + rotor * ddq + scale * (viscous * dq + coulomb * np.tanh(dq / smoothing))
