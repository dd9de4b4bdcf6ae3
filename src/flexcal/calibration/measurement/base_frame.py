"""Points at any poses, measured or not, in the robot's base frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.calibration.measurement.prediction import PredictedMeasurements, predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.kinematics import random_configurations
from flexcal.model.robot import RobotModel


def with_stations_at_base(model: RobotModel) -> RobotModel:
    """Robot all of whose stations stand in its base frame, so that predicted points are in that."""
    return replace(model, stations=replace(model.stations, pose=np.zeros_like(model.stations.pose)))


def seen_from_base(model: RobotModel, poses: PoseSet, *, jacobians: bool = False) -> PredictedMeasurements:
    """Points in the robot's base frame, with the deflection of its springs."""
    return predict_measurements(with_stations_at_base(model), poses, jacobians=jacobians)


def random_poses(model: RobotModel, limits: np.ndarray, targets: Sequence[str], count: int) -> PoseSet:
    """`count` poses for every target, uniform within the limits (2, n), rad or m, the same in every call.

    They are of the first station; readings are zero.
    """
    q = random_configurations(model, count, np.random.default_rng(0), limits[0], limits[1])
    q = np.tile(q, (len(targets), 1))
    return PoseSet.unmeasured(q, np.repeat(list(targets), count), model.stations.names[0])
