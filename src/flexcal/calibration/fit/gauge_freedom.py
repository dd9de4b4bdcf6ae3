"""Gauge freedom: the most probable robot among those with the same measured points.

Positions of a point tell where it moves, not how the flange that carries it is turned, nor whether the point or the flange is off: an
offset of the last joint moves the point as another place of the reflector does. The fit holds such directions at whatever its choice
of parameters leaves. For every frame but the measured point that choice matters, so a robot is taken that measures the same and is most
probable beforehand: joints and flange within manufacturing tolerances, each measured point where a ruler has it, instruments anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.calibration.fit.terms import TOLERANCE, carrying_joints
from flexcal.calibration.kinds import is_inclinometer
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import DIRECTION, PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model.kinematics import found_xyz, joint_limits, random_configurations
from flexcal.model.parts import rotation_wxyz
from flexcal.model.robot import (
    GEOMETRY,
    STATION,
    VERTICAL,
    ZEROS,
    Posterior,
    RobotModel,
    geometric_errors,
    propagated_covariance_root,
    unit_in,
)

KNOWN_POINT_STD = 0.002
"""Standard deviation, m, above which a measured point's place on the tool counts as undetermined."""
POINT_STD = 0.010
"""Standard deviation, m, per coordinate of a point's place measured with a ruler."""
_ANYWHERE = 1.0
"""Standard deviation, m, of that place where it is found beside the flange."""
_POSES = 60
_STEPS = 10
_SMALL = 1e-10
"""Convergence limit, m and rad."""
_UNSEEN = 1e-8
"""Relative singular value below which a direction moves no measured point."""


def probable_robot(model: RobotModel, targets: Sequence[str]) -> RobotModel:
    """First of `probable_robots`."""
    return probable_robots(model, targets)[0]


def probable_robots(model: RobotModel, targets: Sequence[str]) -> tuple[RobotModel, RobotModel]:
    """Robots with their geometry most probable along the directions that do not move the measured points `targets`.

    Weighted least squares of all geometric errors, subject to unchanged positions of the points, and orientations of targets of which they
    were measured, as every calibrated station sees them, by Gauss-Newton, of the robot taken as stiff under gravity: tilting axes would
    show such directions faintly. What these then move the points, by nanometres, all parameters make up for. The posterior follows: what
    was estimated is propagated, and the free directions have the tolerances as their covariance. The second robot is the same with only
    these in its posterior: what the measured points leave open. Both are the
    robot itself where nothing was calibrated.
    """
    stations = _calibrated_stations(model)
    if not stations or not targets:
        return model, model
    names = _names(model, targets, stations)
    std = np.array([_std(model, name, targets) for name in names])
    # where a point lies is its own: its declared place, which --write-point changes, must not pull at the flange
    placing = np.where(std == POINT_STD, _ANYWHERE, std)
    poses = _random_poses(model, targets, stations)
    stiff = replace(
        model,
        geometry=replace(
            model.geometry,
            gravity_compliance=np.zeros_like(model.geometry.gravity_compliance),
            lateral_compliance=np.zeros_like(model.geometry.lateral_compliance),
        ),
    )
    poses = _as_predicted(stiff, poses)
    scale = np.where(np.isfinite(std), std, 1.0)
    weight, placing = (np.where(np.isfinite(each), 1 / each, 0.0) for each in (std, placing))
    seen, free = _directions(stiff, poses, names, scale)
    robot = stiff
    for directions in (seen, np.diag(scale)):
        for _ in range(_STEPS):
            at = predict_measurements(robot, poses, elastic=False, jacobians=True)
            columns = at.jacobian(names).reshape(-1, len(names)) @ directions
            step = directions @ np.linalg.lstsq(columns, at.residual.ravel(), rcond=_UNSEEN)[0]
            values = np.array([robot.value(name) for name in names]) + step
            if directions is seen:
                step += free @ np.linalg.lstsq(placing[:, None] * free, -placing * values, rcond=None)[0]
            changed = np.array([robot.value(name) for name in names]) + step
            robot = robot.with_values(dict(zip(names, changed.tolist(), strict=True)))
            if np.abs(step).max() < _SMALL:
                break
    robot = model.with_values({name: robot.value(name) for name in names})
    whole, unseen = _propagated(robot, names, free, weight, placing)
    return replace(robot, posterior=whole), replace(robot, posterior=unseen)


def _directions(
    model: RobotModel, poses: PoseSet, names: list[str], scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Directions (p, r) of the parameters `names` that move the measured points, and those (p, p - r) that do not, in units of `scale`.

    Of the axes of the URDF, as for the rank of the fit: those that are not quite parallel show faintly what nothing measures. The points
    are where they were found: where they were only declared, what nothing moves there moves them by its rotation times their distance.
    """
    found = ("station.", "point.", "tool.length")
    drawn = model.with_values({name: 0.0 for name in names if not name.startswith(found)})
    columns = predict_measurements(drawn, poses, elastic=False, jacobians=True).jacobian(names)
    columns = columns.reshape(-1, len(names)) * scale
    _, sizes, right = np.linalg.svd(columns, full_matrices=len(columns) < len(names))
    rank = int(np.sum(sizes > _UNSEEN * sizes[0]))
    return scale[:, None] * right[:rank].T, scale[:, None] * right[rank:].T


def with_calibrated_points(nominal: RobotModel, model: RobotModel, targets: Sequence[str]) -> RobotModel:
    """Nominal robot with the calibrated positions of the measured points `targets` of `model` in their frames."""
    values = {}
    for target in targets:
        moved = found_xyz(model, target) - nominal.points[target].xyz
        values |= {f"point.{target}.{axis}": float(v) for axis, v in zip("xyz", moved, strict=True)}
    return nominal.with_values(values)


def point_uncertainty(model: RobotModel, target: str) -> float:
    """Standard deviation (1σ distance, m) of a measured point's place in its frame, by the posterior of `model`."""
    owners = {"tool", f"point.{target}", model.joints[model.point(target).joint].name}
    spread = propagated_covariance_root(model, lambda changed: found_xyz(changed, target), owners)
    return float(np.linalg.norm(spread))


def _names(model: RobotModel, targets: Sequence[str], stations: Sequence[str]) -> list[str]:
    """Names of the geometric parameters; for a station in the base frame without its rotation."""
    names = geometric_errors(model, carrying_joints(model, targets, stations))
    names += [f"tool.{key}" for key in GEOMETRY]
    first = model.tool_point
    names += [
        f"point.{t}.{axis}" for t in targets if t != first and not is_inclinometer(model, t) for axis in "xyz"
    ]
    names += [f"point.{t}.{key}" for t in targets if _is_turned(model, t) for key in STATION[3:]]
    known = model.posterior.parameters
    names += [name for t in targets for key in ZEROS if (name := f"point.{t}.{key}") in known]
    for k, station in enumerate(model.stations.names):
        if station == VERTICAL:
            names += [name for key in STATION[3:] if (name := f"station.{station}.{key}") in known]
        elif station in stations:
            turned = bool(model.stations.pose[k, 3:].any())
            names += [f"station.{station}.{key}" for key in STATION[: 6 if turned else 3]]
    return names


def _std(model: RobotModel, name: str, targets: Sequence[str]) -> float:
    """Prior 1σ of a parameter; infinite if nothing is known."""
    owner, _, key = name.rpartition(".")
    if owner.startswith("station.") or (owner.startswith("point.") and key in (*STATION[3:], *ZEROS)):
        return np.inf
    first = model.tool_point
    pointed = first in targets and not is_inclinometer(model, first)
    if owner.startswith("point.") or (owner == "tool" and key.startswith("length") and pointed):
        return POINT_STD
    return TOLERANCE[unit_in(model, name)]


def _calibrated_stations(model: RobotModel) -> list[str]:
    """Instruments whose place was calibrated, and the vertical where inclinometers were read."""
    known = model.posterior.parameters
    read = any(name.startswith("point.") and name.rpartition(".")[2] in ZEROS for name in known.names)
    return [
        name for name in model.stations.names if f"station.{name}.x" in known or (name == VERTICAL and read)
    ]


def _is_turned(model: RobotModel, target: str) -> bool:
    """Whether the orientation of a target was measured."""
    return f"point.{target}.rx" in model.posterior.parameters


def _as_predicted(model: RobotModel, poses: PoseSet) -> PoseSet:
    """Poses with what `model` predicts as measured: points, orientations of targets whose orientation was measured, and inclinations."""
    turned = np.array([_is_turned(model, target) for target in poses.target.tolist()]) & ~poses.tilted
    quaternion = np.where(turned[:, None], [1.0, 0.0, 0.0, 0.0], np.nan)
    poses = replace(poses, quaternion_wxyz=quaternion)
    at = predict_measurements(model, poses, elastic=False)
    quaternion[turned] = rotation_wxyz(at.orientation[turned[poses.angled]])
    tilt = poses.tilt
    if tilt is not None:
        tilt = tilt.copy()
        tilt[poses.tilted] -= at.residual[len(poses) :][poses.tilted[poses.angled]]
    return replace(poses, position=at.position, quaternion_wxyz=quaternion, tilt=tilt)


def _random_poses(model: RobotModel, targets: Sequence[str], stations: Sequence[str]) -> PoseSet:
    reach = np.where([joint.kind == "prismatic" for joint in model.motor_joints], 1.0, np.pi)
    lower, upper = (np.clip(limit, -reach, reach) for limit in joint_limits(model))
    inclined = [target for target in targets if is_inclinometer(model, target)]
    pairs = [(t, s) for t in targets if t not in inclined for s in stations if s != VERTICAL]
    pairs += [(target, VERTICAL) for target in inclined]
    size = _POSES * len(pairs)
    target = np.repeat([target for target, _ in pairs], _POSES)
    tilted = np.isin(target, inclined)
    read = [[f"point.{t}.{key}" in model.posterior.parameters for key in ZEROS] for t in target.tolist()]
    q = random_configurations(model, size, np.random.default_rng(0), lower, upper)
    return replace(
        PoseSet.unmeasured(q, target, np.repeat([station for _, station in pairs], _POSES), 1.0),
        kind=np.where(tilted, DIRECTION, "") if inclined else None,
        tilt=np.where(np.array(read) & tilted[:, None], 0.0, np.nan) if inclined else None,
    )


def _propagated(
    model: RobotModel, names: list[str], free: np.ndarray, weight: np.ndarray, placing: np.ndarray
) -> tuple[Posterior, Posterior]:
    """Posterior about `model` whose free directions, spanned by `free` (p, k), follow the others to where they are most probable; and
    the part due to these directions alone.
    """
    old = model.posterior
    added = [name for name in names if name not in old.parameters]
    every = [*old.parameters.names, *added]
    covariance = np.zeros((len(every), len(every)))
    covariance[: len(old.parameters), : len(old.parameters)] = old.covariance
    rows = [every.index(name) for name in names]
    precision, along = ((each[:, None] * free).T @ (each[:, None] * free) for each in (weight, placing))
    across = np.eye(len(every))
    across[np.ix_(rows, rows)] -= free @ np.linalg.lstsq(along, free.T * placing**2, rcond=None)[0]
    covariance = across @ covariance @ across.T
    unseen = np.zeros_like(covariance)
    unseen[np.ix_(rows, rows)] = free @ np.linalg.pinv(precision, hermitian=True) @ free.T
    moved = {name: model.value(name) for name in names}
    kept = Parameters(
        replace(item, value=moved[item.name], prior_mean=None) if item.name in moved else item
        for item in old.parameters
    )
    more = Parameters(Parameter(name, unit_in(model, name), moved[name]) for name in added)
    return Posterior(kept + more, covariance + unseen), Posterior(kept + more, unseen)
