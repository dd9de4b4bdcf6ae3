"""Which length of a robot is held where no reading tells how large the robot is, as contacts with planes and spheres do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.fit.terms import (
    declared_size,
    geometric_parameters,
    manufacturing_tolerances,
    plausible_size,
)
from flexcal.calibration.kinds import tells_lengths
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.estimation import analyse
from flexcal.model.robot import RobotModel

_RANK = 1e-6


def held_lengths(model: RobotModel, poses: PoseSet) -> tuple[str, ...]:
    """Names of the length that tells the size of the robot best beforehand, first, and of those that move the points as it does.

    A robot of any size touches planes and spheres of that size: without the length of one link all readings of contacts fit a robot that
    is a point. None where the readings tell lengths, or priors of all of them do.
    """
    poses = poses.pointed
    if not len(poses) or tells_lengths(poses):
        return ()
    parameters = geometric_parameters(model, poses, ["kinematic"])
    parameters = parameters.subset([name for name in parameters.names if not name.startswith("station.")])
    whole = replace(poses, kind=None, socket=None)
    at = predict_measurements(model, whole, elastic=False, jacobians=True)
    columns = at.jacobian(parameters.names)[: len(poses)].reshape(-1, len(parameters))
    identifiability = analyse(columns, parameters.names, scale=manufacturing_tolerances(parameters))
    lengths = [name for name in identifiability.kept_names if ".length_" in name]
    if all(declared_size(model, name) is not None for name in lengths if not name.startswith("tool.")):
        return ()
    own = columns[:, [parameters.names.index(name) for name in lengths]]
    # a larger robot moves every point away from the middle of all, wherever the base is
    point = np.matmul(at.base, at.kinematics.position[:, :, None])[:, :, 0]
    moved = own.reshape(len(point), 3, -1)
    moved = moved - moved.mean(axis=0)
    away = point - point.mean(axis=0)
    shares = np.linalg.lstsq(moved.reshape(own.shape), away.ravel(), rcond=_RANK)[0]
    sizes = np.array([plausible_size(model, name) for name in lengths])
    longest = lengths[int(np.argmax(np.abs(shares) / sizes))]
    alike = (item.name for item in identifiability.dropped if longest in dict(item.absorbed_by))
    return (longest, *alike)
