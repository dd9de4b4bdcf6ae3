"""Sensor models of the virtual cell."""

from __future__ import annotations

import numpy as np

from flexcal.virtual_cell.config import SensorConfig


def encoder_resolution(sensors: SensorConfig) -> float:
    """Angle of one encoder count at the joint, rad; 0 for an ideal encoder."""
    return 2 * np.pi / sensors.encoder_counts if sensors.encoder_counts else 0.0


def read_encoder(sensors: SensorConfig, q: np.ndarray) -> np.ndarray:
    """Joint positions as counted, rad, shape of `q`."""
    resolution = encoder_resolution(sensors)
    return resolution * np.rint(q / resolution) if resolution else q.copy()


def read_torque(sensors: SensorConfig, torque: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Torques with sensor noise, N m, shape of `torque`."""
    return torque + sensors.torque_noise * rng.standard_normal(torque.shape)


def tracker_sigma(sensors: SensorConfig, distance: np.ndarray) -> np.ndarray:
    """Standard deviation an axis of the laser tracker at a distance (m), m, shape of `distance`."""
    return sensors.tracker_noise_m + sensors.tracker_noise_per_m * distance
