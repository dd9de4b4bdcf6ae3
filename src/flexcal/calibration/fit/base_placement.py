"""Geometric errors that are those of where the base stands, and not of the robot."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import (
    joint_limits,
    point_kinematics,
    random_configurations,
    rigid_motion_columns,
)
from flexcal.model.robot import GEOMETRY, RobotModel

_POSES = 40
_AS_ONE = 1e-4
"""Relative motion of the points, beside that of a rigid body, below which the whole robot moves as one."""


def base_errors(model: RobotModel) -> tuple[str, ...]:
    """Names of the errors of joints that move every point as a rigid motion of the whole robot does.

    Offset and tilts of the first axis, and the length along it: another place of the base looks the same. Where the second axis crosses
    the first, a rotation of the second about the first too.
    """
    if not model.points:
        return tuple(f"{joint.name}.{key}" for joint in model.joints if joint.parent < 0 for key in GEOMETRY)
    names = [f"{joint.name}.{key}" for joint in model.joints for key in GEOMETRY]
    columns = [model.geometry_columns[name] for name in names]
    reach = np.where([joint.kind == "prismatic" for joint in model.motor_joints], 1.0, np.pi)
    lower, upper = (np.clip(limit, -reach, reach) for limit in joint_limits(model))
    q = random_configurations(model, _POSES, np.random.default_rng(0), lower, upper)
    at = [point_kinematics(model, q, point=name) for name in model.points]
    own = np.concatenate([a.geometry_jacobian[:, :3][:, :, columns] for a in at]).reshape(-1, len(names))
    position = np.concatenate([a.position for a in at])
    flat = rigid_motion_columns(position).reshape(-1, 6)
    left = own - flat @ np.linalg.lstsq(flat, own, rcond=None)[0]
    as_one = np.linalg.norm(left, axis=0) <= _AS_ONE * np.linalg.norm(own, axis=0)
    return tuple(name for name, one in zip(names, as_one, strict=True) if one)
