"""Readings of sensors on the arm of the virtual robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import factorial

import numpy as np

from flexcal.model.robot import ArmSensor, RobotModel
from flexcal.virtual_cell.config import SensorConfig
from flexcal.virtual_cell.plant import Plant, sensor_site

_WINDOW = 7
"""Number of successive samples of a difference quotient: of sixth order in the middle."""


def mounted(truth: RobotModel, seed: int) -> tuple[ArmSensor, ...]:
    """Sensors of the true robot as mounted: position and direction with errors of the 1σ in robot.yaml."""
    rng = np.random.default_rng([seed, 9])
    placed = []
    for sensor in truth.sensors.values():
        config = sensor.config
        turned = sensor.direction + config.direction_std * rng.standard_normal(3)
        placed.append(
            replace(
                sensor,
                xyz=sensor.xyz + config.position_std * rng.standard_normal(3),
                direction=turned / np.linalg.norm(turned),
            )
        )
    return tuple(placed)


def sensitivities(sensors: Sequence[ArmSensor], seed: int) -> np.ndarray:
    """Sensitivities (S,): ratio of readings to true values."""
    rng = np.random.default_rng([seed, 10])
    stds = np.array([sensor.config.sensitivity_std for sensor in sensors])
    return np.exp(stds * rng.standard_normal(len(sensors)))


def arm_readings(
    truth: RobotModel, plant: Plant, sensors: Sequence[ArmSensor], states: np.ndarray, time_step: float
) -> np.ndarray:
    """True readings (N, S) in m/s², m/s or m for positions (N, d) of the plant, whose sites are where the sensors are.

    Paths and directions of the sites are MuJoCo's, derivatives in time those of polynomials through seven samples: nothing is linearised.
    """
    import mujoco

    data = mujoco.MjData(plant.mjmodel)
    sites = [plant.mjmodel.site(sensor_site(sensor)).id for sensor in sensors]
    place, turn = np.empty((len(states), len(sites), 3)), np.empty((len(states), len(sites), 9))
    for row, position in enumerate(states):
        data.qpos[:] = position
        mujoco.mj_kinematics(plant.mjmodel, data)
        place[row], turn[row] = data.site_xpos[sites], data.site_xmat[sites]
    readings = []
    for k, sensor in enumerate(sensors):
        path = place[:, k] - place[0, k]
        direction = (
            turn[:, k].reshape(-1, 3, 3) @ sensor.direction
            if sensor.moves
            else np.broadcast_to(sensor.direction, path.shape)
        )
        moved = path if sensor.order == 0 else _derivative(path, sensor.order, time_step)
        if sensor.feels_gravity:
            moved = moved - truth.gravity
        readings.append(np.sum(moved * direction, axis=1))
    return np.stack(readings, axis=1)


def reading_noise(sensors: Sequence[ArmSensor], config: SensorConfig) -> np.ndarray:
    """1σ (S,) of a sample, in the unit of the reading."""
    by_order = (config.displacement_noise, config.velocity_noise, config.acceleration_noise)
    return np.array([by_order[sensor.order] for sensor in sensors])


def _derivative(path: np.ndarray, order: int, time_step: float) -> np.ndarray:
    """Derivative in time of a path (N, 3), of the polynomial through seven samples around each; N ≥ 7."""
    middle = _WINDOW // 2
    windows = np.lib.stride_tricks.sliding_window_view(path, _WINDOW, axis=0)
    parts = [windows[:1] @ _weights(at, order) for at in range(middle)]
    parts.append(windows @ _weights(middle, order))
    parts += [windows[-1:] @ _weights(at, order) for at in range(middle + 1, _WINDOW)]
    return np.concatenate(parts) / time_step**order


def _weights(at: int, order: int) -> np.ndarray:
    """Weights (7,) of samples one apart for the derivative of their polynomial at sample number `at`."""
    powers = np.vander(np.arange(_WINDOW) - at, increasing=True).T
    return np.linalg.solve(powers, factorial(order) * np.eye(_WINDOW)[order])
