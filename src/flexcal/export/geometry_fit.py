"""Geometry that makes up for the terms of a calibrated robot that a file format lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from flexcal.export.offset_fit import least_squares
from flexcal.export.representation_error import SAMPLES, DrawPoses, leave_out, poses_of
from flexcal.export.written_file import RenderedModel
from flexcal.model.kinematics import PointKinematics, point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium

_LEVER = 0.1
"""Distance from the points, m, at which other tools are as right as they are: the weight of rotations."""
_REST = 0.01
"""Errors of the points, m per coordinate, that a change of the geometry by 1 m or 1 rad must save: what moves them little stays about as
calibrated, and a small region makes no geometry that is wrong elsewhere."""
_PASSES = 8
_SMALL = 1e-8
"""Step, m and rad, at which the iteration has converged."""
_FEWEST = 200
_FITTED = (
    "In place of what the format cannot carry, the geometry in the file is the one with which the points come nearest to those of the "
    "calibrated robot at rest, in position and direction."
)
_AS_CALIBRATED = "The geometry in the file stands as calibrated and makes up for nothing that it cannot carry: the robot has loops."


def representable_robot(
    model: RobotModel, terms: Sequence[str], draw: DrawPoses | None = None
) -> tuple[RobotModel, tuple[str, ...]]:
    """`model` with the geometry with which it is nearest to the present one where `terms` are left out, and what to say of that.

    Least squares over the poses of `draw`, as `poses_of` takes it, of the positions and orientations of all points at rest, by the errors
    of all joints and the tool. Everything but the geometry stays, the `terms` too. A robot that has none of these, no points, or loops is
    returned as it is.
    """
    bare = reduce(leave_out, terms, model)
    if bare is model or not model.points:
        return model, ()
    if model.relations is not None and model.relations.loops:
        return model, (_AS_CALIBRATED,)
    q = poses_of(model, draw)(None, np.random.default_rng(1))[0]
    q = q[: max(_FEWEST, SAMPLES // len(model.points))]
    rest = static_equilibrium(model, q)
    wanted = {
        name: point_kinematics(model, q, rest.deflection, point=name, jacobians=False)
        for name in model.points
    }
    change = np.zeros(6 * len(model.joints) + 6)
    hold = _REST * np.sqrt(3 * len(q) * len(wanted)) * np.eye(len(change))
    for _ in range(_PASSES):
        moved = _changed(bare, change)
        bent = static_equilibrium(moved, q, flank=rest.flank).deflection
        rows, missing = zip(
            *(
                _rows(moved, point_kinematics(moved, q, bent, point=name), at, name)
                for name, at in wanted.items()
            ),
            strict=True,
        )
        step = least_squares(np.vstack([*rows, hold]), np.concatenate([*missing, -hold @ change]))
        change = change + step
        if np.abs(step).max() < _SMALL:
            break
    return _changed(model, change), (_FITTED,)


def render_representable(
    model: RobotModel, render: Callable[[RobotModel], RenderedModel], draw: DrawPoses | None = None
) -> RenderedModel:
    """`render` of `representable_robot` for the terms that it leaves unrepresented."""
    rendered = render(model)
    robot, said = representable_robot(model, rendered.unrepresented, draw)
    rendered = rendered if robot is model else render(robot)
    return replace(rendered, remarks=(*said, *rendered.remarks))


def _changed(model: RobotModel, change: np.ndarray) -> RobotModel:
    """Robot with other errors of joints and tool, by the `change` (6 N + 6,)."""
    geometry = model.geometry
    errors = geometry.errors + change[:-6].reshape(-1, 6)
    return replace(model, geometry=replace(geometry, errors=errors, tool=geometry.tool + change[-6:]))


def _rows(
    model: RobotModel, at: PointKinematics, wanted: PointKinematics, point: str
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (6 samples, 6 N + 6) and missing (6 samples,) positions and rotations of a point, m, the latter times the lever."""
    joints = 6 * len(model.joints)
    columns = np.delete(at.geometry_jacobian, np.s_[joints:-6], axis=2)
    if point != model.tool_point:
        columns[:, :, -3:] = 0.0
    turn = 0.5 * np.cross(at.orientation, wanted.orientation, axisa=1, axisb=1, axisc=1).sum(axis=2)
    weights = np.repeat([1.0, _LEVER], 3)
    missing = np.concatenate([wanted.position - at.position, turn], axis=1)
    return (columns * weights[:, None]).reshape(-1, joints + 6), (missing * weights).ravel()
