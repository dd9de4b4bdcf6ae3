"""Errors of the arm at the poses of touches: those that a calibration leaves, or those of an arm that was not calibrated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import TOLERANCE, declared_size
from flexcal.calibration.measurement import (
    PredictedMeasurements,
    covariance_root,
    moving_parameters,
    unknown_sides,
)
from flexcal.data.poses import Touches
from flexcal.model.kinematics import PointKinematics
from flexcal.model.robot import GEOMETRY, RobotModel, geometric_errors, unit_in
from flexcal.model.statics import Equilibrium, tool_at_rest

_TYPICAL = 2.0
"""Median size of the joint errors of an uncalibrated arm, relative to the tolerances of manufacture: 1 mrad and 0.6 mm."""
_FACTOR = 2.0
"""Factor by which that size varies from arm to arm (1σ)."""
_SIZES = np.geomspace(0.125, 4.0, 16)
"""Sizes that are tried, relative to the median."""


@dataclass(frozen=True, eq=False)
class TouchedFrames:
    """Places of a tool frame when it touched: `position` (N, 3), m, and `rotation` (N, 3, 3) in the base frame, and their derivatives."""

    model: RobotModel
    point: str
    touches: Touches
    position: np.ndarray
    rotation: np.ndarray
    rest: Equilibrium
    kinematics: PointKinematics


@dataclass(frozen=True, eq=False)
class ArmErrors:
    """Joint distribution of the errors of a point at N poses, in the base frame.

    Attributes
    ----------
    covariance : ndarray
        Covariance (3 N, 3 N), m², of errors of size 1.
    sizes : mapping of float
        Prior probability of each size, up to a factor; 1 alone where the arm is calibrated.
    calibrated : bool
        Whether the covariance is that of a calibration.
    angle, length : float
        Standard deviations of a joint's errors of size 1, rad and m, of an arm that is not calibrated; the largest of all joints.
    """

    covariance: np.ndarray
    sizes: Mapping[float, float]
    calibrated: bool
    angle: float
    length: float


def touched_frames(model: RobotModel, touches: Touches, point: str) -> TouchedFrames:
    """Places of the frame of a point, with its origin in the point, for the deflected robot at rest.

    Raises `FlexcalError` for an unknown point and for payloads that robot.yaml does not declare.
    """
    tool = tool_at_rest(model, touches.q, touches.payload, np.full(len(touches), point), jacobians=True)
    at = tool.kinematics
    return TouchedFrames(model, point, touches, at.position, at.orientation, tool.rest, at)


def is_calibrated(model: RobotModel) -> bool:
    """Whether the geometry of any joint was estimated."""
    return any(
        model.posterior.determines(f"{joint}.{key}") for joint in model.joint_names for key in GEOMETRY
    )


def arm_errors(frames: TouchedFrames, *, tool: bool, gauge: bool = True, scatter: bool = True) -> ArmErrors:
    """Errors of the point of these frames.

    Of a calibrated robot the covariance of its parameters and, with `scatter`, its scatter are propagated. Of another robot every joint has
    errors of an unknown common size, in proportion to what robot.yaml declares under `prior:` or else to the tolerances of manufacture.
    Errors that move the whole robot as one, at the base, change nothing that the robot does with what it touched, and count for nothing;
    with `tool` those that the place of the point on the tool takes up do count. Without `gauge` the posterior has none of these, and all of
    it counts.
    """
    model, touches = frames.model, frames.touches
    joints = model.moving(model.point(frames.point).joint)
    rigid = _rigid_names(model, joints, frames.point, tool=tool) if gauge else set()
    calibrated = is_calibrated(model)
    known = [
        name for name in moving_parameters(model) if model.posterior.determines(name) and name not in rigid
    ]
    prediction = _prediction(frames)
    rows = 3 * len(touches)
    columns = [np.zeros((rows, 0))]
    if known:
        columns.append(unknown_sides(prediction).reshape(rows, -1))
        columns.append(prediction.jacobian(known).reshape(rows, -1) @ covariance_root(model, known))
    std: dict[str, float] = {}
    if not calibrated:
        names = geometric_errors(model, joints)
        std = {name: _typical_size(model, name) for name in names if name not in rigid}
        columns.append(prediction.jacobian(list(std)).reshape(rows, -1) * np.array(list(std.values())))
    shared = np.concatenate(columns, axis=1)
    covariance = shared @ shared.T + (_scatter(prediction) if calibrated and scatter else 0.0)
    weights = np.exp(-0.5 * (np.log(_SIZES) / np.log(_FACTOR)) ** 2)
    sizes = {1.0: 1.0} if calibrated else dict(zip(_SIZES.tolist(), weights.tolist(), strict=True))
    angles = [size for name, size in std.items() if unit_in(model, name) == "rad"]
    lengths = [size for name, size in std.items() if unit_in(model, name) == "m"]
    return ArmErrors(covariance, sizes, calibrated, max(angles, default=0.0), max(lengths, default=0.0))


def _rigid_names(model: RobotModel, joints: tuple[int, ...], point: str, *, tool: bool) -> set[str]:
    """Names of the parameters that move the whole robot, or its tool, as one."""
    first, last = model.joints[joints[0]].name, model.joints[joints[-1]].name
    names = {f"{first}.{key}" for key in GEOMETRY[:3]}
    names |= {name for name in model.posterior.parameters.names if name.startswith("station.")}
    others = {name for name in model.posterior.parameters.names if name.startswith("point.")}
    if tool:
        return names | {name for name in others if not name.startswith(f"point.{point}.")}
    return (
        names
        | others
        | {f"tool.{key}" for key in GEOMETRY}
        | {f"{last}.{key}" for key in (GEOMETRY[0], *GEOMETRY[3:])}
    )


def _typical_size(model: RobotModel, name: str) -> float:
    declared = declared_size(model, name)
    return _TYPICAL * TOLERANCE[unit_in(model, name)] if declared is None else declared


def _prediction(frames: TouchedFrames) -> PredictedMeasurements:
    """Positions of the point as an instrument in the base frame would measure them."""
    count = len(frames.touches)
    poses = frames.touches.as_poses(frames.point)
    base = np.broadcast_to(np.eye(3), (count, 3, 3))
    return PredictedMeasurements(
        frames.model,
        poses,
        frames.position,
        frames.position,
        base,
        frames.rest,
        frames.kinematics,
        frames.kinematics,
        None,
    )


def _scatter(prediction: PredictedMeasurements) -> np.ndarray:
    """Covariance (3 N, 3 N) of repeatability and model error, independent from pose to pose."""
    model, count = prediction.model, len(prediction.position)
    size = model.value("scatter.robot") ** 2 + model.value("scatter.model") ** 2
    single = np.broadcast_to(size * np.eye(3), (count, 3, 3)).copy()
    angular = model.scatter.turns(model.value("scatter.angular"))
    if angular.any():
        revolute = [i for i, joint in enumerate(model.joints) if joint.kind == "revolute"]
        offsets = [f"{model.joints[i].name}.offset" for i in revolute]
        turns = prediction.jacobian(offsets) * angular[revolute]
        single += turns @ turns.swapaxes(1, 2)
    whole = np.zeros((3 * count, 3 * count))
    for k in range(count):
        whole[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = single[k]
    return whole
