"""Target poses of the tool from a file of targets."""

from __future__ import annotations

import numpy as np

from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.data.poses import ToolTargets
from flexcal.errors import FlexcalError
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import points_kinematics

_POINT, _POSE = 3, 6


def desired_pose(model: RobotModel, nominal: RobotModel, targets: ToolTargets) -> ToolPoseTarget:
    """Desired position and, if it counts, rotation of every target in the base frame.

    Points and orientations are those of the file, else those that the `nominal` robot takes at the file's joint positions. A point alone
    leaves the orientation free, and so do joint positions of an arm with fewer than six joints before the tool. Points in an instrument's
    frame are brought to the base frame by where `model` has its station. Raises `FlexcalError` for an orientation asked of an arm whose
    joints are all needed for the position, or beside another arm.
    """
    counts = {name: joints_before(model, name) for name in set(targets.target.tolist())}
    short = [name for name, count in counts.items() if count < _POSE]
    if targets.rotation is not None and short and not _POINT < min(counts.values()) == max(counts.values()):
        raise FlexcalError(
            "E-COMP-001",
            f"{model.name} has {joints_before(model, short[0])} joints before '{short[0]}' and cannot take every orientation; "
            "leave qw, qx, qy, qz out.",
        )
    position, rotation = targets.position, targets.rotation
    if targets.station is not None:
        assert position is not None
        position, rotation = _from_stations(model, targets.station, position, rotation)
    if targets.q is not None:
        at = points_kinematics(nominal, targets.q, None, targets.target, jacobians=False)
        position = at.position if position is None else position
        rotation = at.orientation if rotation is None else rotation
    assert position is not None
    return ToolPoseTarget(targets.target, position, None if short and targets.rotation is None else rotation)


def spare_joints(model: RobotModel, targets: ToolTargets) -> int | None:
    """Number of joints with which an arm turns its tool, where orientations are asked of one that cannot take every one; else None."""
    count = min(joints_before(model, name) for name in set(targets.target.tolist()))
    return count - _POINT if targets.rotation is not None and count < _POSE else None


def joints_before(model: RobotModel, target: str) -> int:
    """Number of motors that move a point."""
    return len(set(model.moving(model.point(target).joint)) & set(model.motors))


def _from_stations(
    model: RobotModel, station: np.ndarray, position: np.ndarray, rotation: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray | None]:
    places = np.array([model.standing_station(name) for name in station.tolist()])
    turns = np.array([vector_rotation(place[3:]) for place in places])
    back = np.swapaxes(turns, 1, 2)
    moved = np.matmul(back, (position - places[:, :3])[:, :, None])[:, :, 0]
    return moved, None if rotation is None else np.matmul(back, rotation)
