"""Growth of links and drift of joint zeros with the temperature of the arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics.forward import PointKinematics
from flexcal.model.kinematics.link_poses import link_frames
from flexcal.model.kinematics.placements import point_placement
from flexcal.model.robot import RobotModel, Thermal


def temperature_rise(model: RobotModel, temperature: np.ndarray) -> np.ndarray:
    """Temperatures (N,) above that at which the robot's parameters hold, K."""
    return temperature - model.thermal.reference[0]


def depends_on_temperature(model: RobotModel) -> bool:
    """Whether the robot, or where its instruments stand, changes with temperature."""
    thermal = model.thermal
    moving = (thermal.expansion, thermal.link_expansion, thermal.zero_drift, model.stations.drift)
    return any(bool(values.any()) for values in moving)


Ends = Mapping[str, tuple[int, np.ndarray]]
"""Points by name: index of the joint whose link carries each, and its position (3,), m, in that link."""


def point_ends(model: RobotModel, names: np.ndarray) -> Ends:
    """Targets by their `names`, with the errors of link and tool."""
    return {name: point_placement(model, name)[:2] for name in dict.fromkeys(names.tolist())}


def carrier_ends(model: RobotModel) -> Ends:
    """Nominal places of the instruments that the robot carries, by station."""
    lengths = model.geometry.errors[:, 3:]
    return {
        name: (frame.joint, frame.translation + frame.rotation @ frame.xyz + lengths[frame.joint])
        for name, frame in model.carriers.items()
    }


def link_vectors(model: RobotModel, q: np.ndarray, end: tuple[int, np.ndarray]) -> np.ndarray:
    """Vectors (N, joints, 3), m, of every link from its joint to the next one on the way to a point, in the base frame.

    Zero for links that do not carry it. Motion of slides counts as length of the link before them. Deflection turns links by some 1e-3,
    which is left out.
    """
    rotation, origin = link_frames(model, q)
    vectors, last = np.zeros((len(q), len(model.joints), 3)), end[0]
    for i, after in pairwise(model.path_to(last)):
        vectors[:, i] = origin[:, after] - origin[:, i]
    vectors[:, last] = rotation[:, last] @ end[1]
    return vectors


def expanded(
    model: RobotModel, q: np.ndarray, at: PointKinematics, names: np.ndarray, ends: Ends, rise: np.ndarray
) -> PointKinematics:
    """Points `at` their places at the reference temperature, by their `names` (N,), where the arm is warmer by `rise` (N,), K.

    All lengths from the base on grow by 1 + α ΔT, so that the position does; no angle changes. What single links grow beyond that
    adds to it along the `link_vectors`; that these turn with the joints is left out of the derivatives, some 1e-4 of them.
    """
    factor = 1 + model.thermal.expansion[0] * rise
    position = at.position * factor[:, None]
    if model.thermal.link_expansion.any():
        for name, end in ends.items():
            own = names == name
            grown = np.einsum("i,nik->nk", model.thermal.link_expansion, link_vectors(model, q[own], end))
            position[own] += rise[own, None] * grown
    geometry, motion = at.geometry_jacobian, at.motion_jacobian
    if len(geometry):
        geometry = geometry.copy()
        geometry[:, :3] *= factor[:, None, None]
    if len(motion):
        motion = motion.copy()
        motion[:, :3] *= factor[:, None, None, None]
    return replace(at, position=position, geometry_jacobian=geometry, motion_jacobian=motion)


def at_temperature(model: RobotModel, temperature: float) -> RobotModel:
    """Robot whose parameters hold at another temperature, °C, and which does not change with temperature itself.

    Links, the tool and the travel of slides are as long as they are then, by their length errors, and zeros of joints where they are then.
    Raises `FlexcalError` for a robot with loops.
    """
    if not depends_on_temperature(model):
        return model
    rise = float(temperature_rise(model, np.array([temperature]))[0])
    if model.relations is not None and model.relations.loops and rise != 0:
        raise FlexcalError(
            "E-MODEL-017",
            f"the lengths of {model.name}, which has loops, cannot be given for another temperature than {temperature - rise:.1f} °C.",
        )
    thermal, geometry = model.thermal, model.geometry
    whole = float(thermal.expansion[0]) * rise
    own = whole + thermal.link_expansion * rise
    errors, origin = geometry.errors.copy(), geometry.origin_error.copy()
    ratios = model.drives.ratio_error.copy()
    for i, joint in enumerate(model.joints):
        grown = own[joint.parent] if joint.parent >= 0 else whole
        length = np.zeros(3) if joint.parent < 0 else geometry.errors[joint.parent, 3:]
        growth = grown * (joint.translation + geometry.origin_error[i] + length)
        if joint.parent >= 0 and i not in model.branching:
            errors[joint.parent, 3:] += growth
        else:
            origin[i] += growth
        if joint.kind == "prismatic":
            errors[i, 0] *= 1 + grown
            ratios[i, i] += grown
    for i in model.branching:
        parent = model.joints[i].parent
        if parent >= 0:
            origin[i] -= errors[parent, 3:] - geometry.errors[parent, 3:]
    errors[:, 0] += thermal.zero_drift * rise
    points = geometry.point_error.copy()
    for k, name in enumerate(model.points):
        carrier, position, rotation = point_placement(model, name)
        moved = errors[carrier, 3:] - geometry.errors[carrier, 3:]
        points[k] += rotation.T @ (own[carrier] * position - moved)
    stations = model.stations.pose.copy()
    stations[:, :3] += model.stations.drift * rise
    return replace(
        model,
        geometry=replace(geometry, errors=errors, origin_error=origin, point_error=points),
        drives=replace(model.drives, ratio_error=ratios),
        stations=replace(model.stations, pose=stations, drift=np.zeros_like(model.stations.drift)),
        thermal=Thermal.at_reference(len(model.joints), temperature),
    )
