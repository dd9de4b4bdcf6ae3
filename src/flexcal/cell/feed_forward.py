"""The feed-forward of the virtual cell's controller: inverse dynamics of the robot that the controller believes in."""

from __future__ import annotations

import numpy as np

from flexcal.cell.plant import Plant, gravity_stiffness, linearise


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
