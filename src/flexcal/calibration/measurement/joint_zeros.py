"""Registration of the instrument together with the joint zeros, where these are far off, as of arms that were assembled by hand."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.kinds import wrong_readings
from flexcal.calibration.measurement.prediction import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import STATION, RobotModel

_FAR = 0.02
"""Residual of a registration relative to the extent of the points (root mean square both) from which the zeros are fitted with it."""
_FAR_OF_REACH = 0.005
"""The same relative to the robot's reach: points of small motions tell nothing of the zeros."""
_TYPICAL_ZERO, _TYPICAL_POINT = 0.1, 0.01
"""Sizes of errors of joint zeros, rad, and of points on the tool, m, that count alike."""
_EXPLAINED, _PLAY = 0.5, 6e-3
"""Zeros explain a residual that falls to this share, or to this size, m (root mean square of a coordinate), as play in joints leaves."""
_STEPS = 50
_SMALL_STEP = 1e-7


def register_with_zeros(registered: RobotModel, poses: PoseSet) -> RobotModel | None:
    """Robot with stations, joint zeros and points as their best fit has them: `with_places_of` takes the places alone from it.

    None where all points of instruments, `registered` by best fit, are no farther from the robot than errors of manufacture explain, and
    where zeros do not explain what the registration leaves, as of data of another robot.

    Wrong zeros bend the arm, and a registration of the nominal arm then tilts the base, by as much as the zeros are off.
    Levenberg-Marquardt, with zeros of 0.1 rad and points off by 10 mm taken as likely.
    """
    if not poses.located.all():
        return None
    poses = poses.without_orientations()
    residual = predict_measurements(registered, poses, elastic=False).residual
    near = ~wrong_readings(np.linalg.norm(residual, axis=1))
    poses, first = poses.subset(near), float(np.mean(residual[near] ** 2))
    extent = poses.position - poses.position.mean(axis=0)
    if first <= max(_FAR**2 * float(np.mean(extent**2)), (_FAR_OF_REACH * registered.reach) ** 2):
        return None
    stations = [f"station.{name}.{key}" for name in poses.stations for key in STATION]
    offsets = [f"{joint.name}.offset" for joint in registered.joints if joint.kind == "revolute"]
    points = [f"point.{target}.{axis}" for target in poses.targets for axis in "xyz"]
    names = [*stations, *offsets, *points]
    likely = [np.inf] * len(stations) + [_TYPICAL_ZERO] * len(offsets) + [_TYPICAL_POINT] * len(points)
    weak = 1 / np.array(likely)
    start = np.array([registered.value(name) for name in names])
    best, least, damping = start, np.inf, 1e-3
    trial, equations, right = start, np.zeros((0, len(names))), np.zeros(0)
    for _ in range(_STEPS):
        model = registered.with_values(dict(zip(names, trial.tolist(), strict=True)))
        at = predict_measurements(model, poses, elastic=False, jacobians=True)
        if (cost := float(np.mean(at.residual**2))) < least:
            best, least, damping = trial, cost, damping / 10
            noise = np.sqrt(cost) + _SMALL_STEP
            equations = np.concatenate([at.jacobian(names).reshape(-1, len(names)), noise * np.diag(weak)])
            right = np.concatenate([at.residual.ravel(), noise * weak * (start - best)])
        else:
            damping *= 10
        damped = np.sqrt(damping) * np.diag(np.linalg.norm(equations, axis=0))
        step = np.linalg.lstsq(
            np.concatenate([equations, damped]), np.concatenate([right, np.zeros(len(names))]), rcond=None
        )[0]
        if np.abs(step).max() < _SMALL_STEP:
            break
        trial = best + step
    if np.sqrt(least) > max(_EXPLAINED * np.sqrt(first), _PLAY):
        return None
    return registered.with_values(dict(zip(names, best.tolist(), strict=True)))


def with_places_of(model: RobotModel, found: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot with the places of stations, and the axes of targets, of another that was `found` with other joint zeros."""
    names = [f"station.{name}.{key}" for name in poses.stations for key in STATION]
    names += [f"point.{target}.{key}" for target in poses.targets for key in STATION[3:]]
    return model.with_values({name: found.value(name) for name in names})
