"""What an instrument reads of a target: its coordinates, its distance, or its distance from a plane or a line."""

from __future__ import annotations

import numpy as np

from flexcal.data.poses import DISTANCE, PoseSet
from flexcal.model.robot import RobotModel


def instrument_readings(model: RobotModel, poses: PoseSet, located: np.ndarray) -> np.ndarray:
    """Readings (N, 3), m, of targets at `located` (N, 3), m, in their stations' axes; zero where a coordinate is not measured.

    A distance is read with the station's `zero` taken off, and with the relative deviation of the wires' scale.
    """
    if poses.kind is None:
        return located
    readings = np.where(poses.present, located, 0.0)
    far = poses.kind == DISTANCE
    zero = np.array([model.stations.zero[model.station_index(name)] for name in poses.station[far].tolist()])
    readings[far, 0] = np.linalg.norm(located[far], axis=1) - zero
    return readings


def reading_slopes(poses: PoseSet, located: np.ndarray) -> np.ndarray | None:
    """Change (N, 3, 3) of `instrument_readings` with a displacement of the target; None where all read coordinates."""
    if poses.kind is None:
        return None
    slopes = np.eye(3) * poses.present[:, :, None]
    far = poses.kind == DISTANCE
    length = np.linalg.norm(located[far], axis=1, keepdims=True)
    slopes[far, 0] = np.divide(located[far], length, out=np.zeros_like(located[far]), where=length > 0)
    return slopes
