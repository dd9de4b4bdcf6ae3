"""Visibility of the reflector: acceptance angle, and line of sight past the robot."""

from __future__ import annotations

import numpy as np

from flexcal.design.scene.collision import CollisionChecker
from flexcal.design.scene.measuring_setup import STANDARD, MeasuringSetup
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import link_frames, point_kinematics
from flexcal.model.robot import RobotModel

BEAM_RADIUS = 0.01
"""Radius of the line of sight, m."""
TARGET_CLEARANCE = 0.03
"""Distance before the target, m, at which the line of sight ends: the reflector has a mount."""


def station_position(model: RobotModel, station: str | None = None) -> np.ndarray | None:
    """Position (3,), m, of the instrument in the base frame; None if robot.yaml gives none there. The first station without a name.

    Raises `FlexcalError` for an unknown name.
    """
    declared = model.config.stations
    if station is not None and station not in model.stations.names:
        raise FlexcalError(
            "E-DESIGN-040",
            f"there is no station '{station}' in {model.path}; there are {', '.join(model.stations.names)}.",
        )
    entry = declared.get(model.stations.names[0] if station is None else station)
    return None if entry is None or entry.in_base is None else np.array(entry.in_base)


def visible(checker: CollisionChecker, q: np.ndarray, setup: MeasuringSetup = STANDARD) -> np.ndarray:
    """Mask (samples,) of configurations `q` (samples, n) at which the instrument sees the target.

    The line of sight is a cylinder; it is only asked for where the station declares `line_of_sight`. Obstacles block it too. A robot.yaml
    without the station's place sees everything. Raises `FlexcalError` for an unknown point or station.
    """
    model = checker.model
    origin = station_position(model, setup.station)
    if origin is None:
        return np.ones(len(q), dtype=bool)
    target = point_kinematics(model, q, point=setup.point, jacobians=False)
    seen = np.ones(len(q), dtype=bool)
    if setup.acceptance is not None:
        towards = origin - target.position
        axis = np.array(setup.acceptance.axis) / np.linalg.norm(setup.acceptance.axis)
        cosine = np.einsum("sij,j,si->s", target.orientation, axis, towards)
        seen = cosine >= np.cos(setup.acceptance.half_angle) * np.linalg.norm(towards, axis=1)
    if model.config.stations[setup.station or model.stations.names[0]].line_of_sight:
        left = np.flatnonzero(seen)
        seen[left] = ~line_of_sight_blocked(
            checker, q[left], origin, target.position[left], BEAM_RADIUS, TARGET_CLEARANCE
        )
    return seen


def line_of_sight_blocked(
    checker: CollisionChecker,
    q: np.ndarray,
    origin: np.ndarray,
    target: np.ndarray,
    radius: float,
    clearance: float,
) -> np.ndarray:
    """Whether a beam from `origin` (3,) to `clearance` before `target` (samples, 3) meets a shape of the robot or an obstacle.

    A shape whose bounding sphere the beam misses is settled in one sweep over all samples; coal looks at the others.
    """
    import coal

    rotation, position = link_frames(checker.model, q)
    span = target - origin
    distance = np.linalg.norm(span, axis=1)
    direction = span / distance[:, None]
    length = np.maximum(distance - clearance, 1e-3)
    beams = [coal.Capsule(radius, float(reach)) for reach in length]
    middles = origin + direction * (length / 2)[:, None]
    turns = _towards(direction)
    request = coal.CollisionRequest()
    result = np.zeros(len(q), dtype=bool)
    for shape in checker.shapes:
        if shape.joint < 0:
            turned = np.broadcast_to(shape.rotation, (len(q), 3, 3))
            placed = np.broadcast_to(shape.translation, (len(q), 3))
        else:
            turned = rotation[:, shape.joint] @ shape.rotation
            placed = position[:, shape.joint] + rotation[:, shape.joint] @ shape.translation
        shape.geometry.computeLocalAABB()
        centre = placed + turned @ np.array(shape.geometry.aabb_center)
        along = np.clip(np.einsum("si,si->s", centre - origin, direction), 0.0, length)
        apart = np.linalg.norm(origin + along[:, None] * direction - centre, axis=1)
        for s in np.flatnonzero(~result & (apart <= shape.geometry.aabb_radius + radius)):
            hit = coal.CollisionResult()
            body, beam = coal.Transform3s(turned[s], placed[s]), coal.Transform3s(turns[s], middles[s])
            result[s] = coal.collide(shape.geometry, body, beams[s], beam, request, hit) > 0
    return result


def _towards(direction: np.ndarray) -> np.ndarray:
    """Rotations (samples, 3, 3) whose z axes are the unit vectors `direction` (samples, 3)."""
    least = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    x = np.cross(least, direction)
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(direction, x), direction], axis=2)
