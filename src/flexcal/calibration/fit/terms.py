"""Parameters of a calibration: the 47 kinematic ones and those of further terms."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from flexcal.calibration.error_model import are_different
from flexcal.calibration.fit.base_placement import base_errors
from flexcal.calibration.fit.thermal_terms import THERMAL, plausible_thermal_size, thermal_parameters
from flexcal.calibration.kinds import ANGULAR, KINDS, declared_level, kind_of
from flexcal.calibration.measurement import Readings, predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model.parts import LOOP
from flexcal.model.robot import (
    GEOMETRY,
    HYSTERESIS,
    LATERAL,
    ORIGIN,
    RATIO,
    STATION,
    RobotModel,
    geometric_errors,
    ratio_errors,
    unit_in,
)
from flexcal.model.statics import (
    carried_mass,
    force_moments,
    gravity_moments,
    gravity_torque,
    lateral_axes,
)

LEAST_POSES, LEAST_COORDINATES = 20, 60
"""Least numbers of different poses, and of measured coordinates, for a selection of terms and for the variance of transmission errors."""

TOLERANCE = {
    "m": 3e-4,
    "rad": 5e-4,
    "rad/(N m)": 1e-6,
    "1": 1e-3,
    "m/rad": 1e-5,
    "rad/m": 1e-3,
    "1/K": 1e-5,
    "rad/K": 1e-5,
    "m/K": 1e-5,
}
"""Size of a relevant change (1σ of manufacture), by unit, which makes parameters of different units comparable."""


LEVELS = ("offsets", "lengths", "kinematic")
"""Terms of the rigid geometry, each with the parameters of those before it: joint zeros; lengths of links too; all errors of all axes."""
PER_JOINT = ("gravity_compliance", "lateral_compliance")
"""Kinds of terms that may be named for one joint, as `<joint>.<kind>`: compliance about its axis, and about the two axes normal to it."""


_LOADED = 0.01
"""Least standard deviation of a gravity load, relative to the largest, at which its compliance is separable from a constant."""
_LEAST_LOAD = 1e-6
"""Load, N m, below which it is a rounding error."""


def enough_for_terms(poses: PoseSet) -> bool:
    """Whether there are enough poses, and numbers read at them, for a selection of terms and for the variance of transmission errors."""
    return are_different(poses.q, LEAST_POSES) and coordinates(poses) >= LEAST_COORDINATES


def coordinates(poses: PoseSet) -> int:
    """Number of measured coordinates."""
    return int(Readings.of(poses).present.sum())


def geometric_parameters(model: RobotModel, poses: PoseSet, terms: Sequence[str]) -> Parameters:
    """Geometric parameters of some terms, starting at the model's values (Neubauer et al. 2015, §3).

    `kinematic`: a place for every station, and a rotation for all but the first, whose rotation the first joint's errors span; the
    `geometric_errors` of every joint that moves a measured target, six for the tool, three for each further target, and a rotation for each
    target whose orientation was measured. A wire has a place and a zero, a touched plane a height and two tilts. Without an instrument of
    points nothing tells where the robot's base is: all places may turn, and errors of joints that move the whole robot as one are left out.
    An inclinometer has its mounting and the zeros of its axes, the vertical two inclinations unless the base is declared level.
    `offsets` in its stead has of these the places of stations and points, joint offsets and the rotations of the base, `lengths` the
    lengths of links too.
    `backlash`: the joints declared with it; `transmission` none, its waves being random effects (`random_waves`).
    `gravity_compliance`, `lateral_compliance`, `transmission_1`…: one or two for every revolute joint on the way, compliances only where
    no spring is declared in their place and gravity loads the axis: by moments that vary by more than 1 % of those that vary most.
    `<joint>.gravity_compliance` is that of one joint. Those of temperature are in `thermal_parameters`.
    """
    joints = moving_joints(model, poses)
    level = next((term for term in terms if term in LEVELS), None)
    names = [] if level is None else _kinematic(model, poses, joints)
    items = [_parameter(model, name) for name in names if level and _is_of_level(model, name, level)]
    if "backlash" in terms:
        items += [
            _parameter(model, f"{model.joints[i].name}.backlash", lower=0.0)
            for i in model.backlash_joints
            if i in joints
        ]
    further: dict[str, None] = {}
    loaded = loaded_compliances(model, poses) if any(t.endswith(PER_JOINT) for t in terms) else frozenset()
    for term in terms:
        owner, _, kind = term.rpartition(".")
        if kind in (*LEVELS, "backlash", "transmission"):
            continue
        if kind in THERMAL:
            further |= dict.fromkeys(thermal_parameters(model, poses, term, joints))
            continue
        if kind == "ratio":
            further |= dict.fromkeys(ratio_parameters(model, joints))
            continue
        own = [model.joint_index(owner)] if owner else free_joints(model, kind, joints)
        for i in own:
            every = [f"{model.joints[i].name}.{key}" for key in _keys(kind)]
            seen = [name for name in every if name in loaded or kind not in PER_JOINT]
            further |= dict.fromkeys(every if owner and not seen else seen)
    return Parameters([*items, *(_parameter(model, name) for name in further)])


def lag_parameters(model: RobotModel, poses: PoseSet) -> Parameters:
    """Half the width of the hysteresis of every revolute joint of which any of the poses says from which side it came, with its prior.

    With one side alone it cannot be told from the joint's offset, and carries its prior into every prediction for the other side.
    """
    if poses.approach is None:
        return Parameters([])
    sided = {model.motors[k] for k in np.flatnonzero(poses.approach.any(axis=0)).tolist()}
    names = [
        f"{model.joints[i].name}.{HYSTERESIS}"
        for i in moving_joints(model, poses)
        if i in sided and model.joints[i].kind == "revolute"
    ]
    return Parameters(
        Parameter(name, "rad", model.value(name), prior_std=plausible_size(model, name)) for name in names
    )


def _kinematic(model: RobotModel, poses: PoseSet, joints: Sequence[int]) -> list[str]:
    """Names of the term `kinematic`."""
    level = declared_level(model, poses)
    names: list[str] = []
    known = next((name for name in poses.station[poses.located].tolist() if name not in model.carriers), None)
    for station in poses.stations:
        told = kind_of(poses, station).place(model, poses, station, turned=station != known or level)
        names += [f"station.{station}.{key}" for key in told]
    errors = geometric_errors(model, joints)
    placed = poses.located.any() or level or not len(poses.pointed)
    as_one = () if placed else base_errors(model)
    names += [name for name in errors if name not in as_one]
    names += [f"tool.{key}" for key in GEOMETRY]
    first = model.tool_point
    names += [f"point.{t}.{key}" for t in poses.pointed.targets if t != first for key in "xyz"]
    for kind in ANGULAR:
        for target in dict.fromkeys(poses.target[kind.rows(poses)].tolist()):
            names += [f"point.{target}.{key}" for key in kind.target_parameters(poses, target)]
    return names


def _is_of_level(model: RobotModel, name: str, level: str) -> bool:
    owner, _, key = name.rpartition(".")
    if level == "kinematic" or key not in (*GEOMETRY, *ORIGIN):
        return True
    if key in ORIGIN:
        return level == "lengths"
    if owner == "tool" or level == "lengths":
        return key.startswith("length") or (key == "offset" and owner != "tool") or _is_at_base(model, owner)
    return key == "offset" or (_is_at_base(model, owner) and not key.startswith("length"))


def _is_at_base(model: RobotModel, owner: str) -> bool:
    return owner in model.joint_names and model.joints[model.joint_index(owner)].parent < 0


def random_waves(model: RobotModel, poses: PoseSet, free: Parameters) -> dict[str, float]:
    """Waves of the term `transmission`, each with its size relative to order 1: √(distance of the orders) / order.

    Those of every revolute joint on the way to a measured target that are not among the `free` parameters. With these sizes the error of
    a joint is as rough as a random walk, so that what is known of a part of the range says little of angles far from it.
    """
    joints = free_joints(model, "transmission", moving_joints(model, poses))
    orders = np.array(model.drives.harmonics, dtype=float)
    sizes = np.sqrt(np.gradient(orders) if len(orders) > 1 else 1.0) / orders
    every = {
        f"{model.joints[i].name}.{key}": float(size)
        for i in joints
        for order, size in zip(model.drives.harmonics, sizes, strict=True)
        for key in _keys(f"transmission_{order}")
    }
    return {name: size for name, size in every.items() if name not in free}


def ratio_parameters(model: RobotModel, joints: Sequence[int]) -> list[str]:
    """Names of the term `ratio`: scales of slides, and ratios by which joints follow others, of some `joints`."""
    names = model.joint_names
    return [f"{names[i]}.{RATIO}{names[k]}" for i in joints for k in ratio_errors(model, i)]


def free_joints(model: RobotModel, kind: str, joints: Sequence[int]) -> list[int]:
    """Revolute joints that may have a term of this kind: those without a spring declared in robot.yaml in its place.

    Joints that a loop determines have only the lateral kind.
    """
    springs = {e.index: e.components for e in model.elastic}
    taken = {"gravity_compliance": 2, "lateral_compliance": 0}.get(kind)
    held = () if model.relations is None or kind == "lateral_compliance" else model.relations.passive
    return [
        i
        for i in joints
        if model.joints[i].kind == "revolute" and taken not in springs.get(i, ()) and i not in held
    ]


@lru_cache(maxsize=4)
def loaded_compliances(model: RobotModel, poses: PoseSet) -> frozenset[str]:
    """Names of the compliances of joints whose load, of gravity and known forces, varies by more than 1 % of that which varies most.

    Kept for the last few robots and poses, of which the selection of terms asks once a term.
    """
    masses = carried_mass(model, poses.payload, len(poses))
    loads = np.concatenate(
        [gravity_torque(model, poses.q, masses)[:, :, None], gravity_moments(model, poses.q, masses)], axis=2
    )
    if poses.force is not None:
        at = predict_measurements(model, poses, elastic=False, jacobians=True).kinematics
        moments = force_moments(at, poses.force)
        across = np.matmul(lateral_axes(model, poses.q), moments[:, :, :2, None])[:, :, :, 0]
        loads -= np.concatenate([moments[:, :, 2:], across], axis=2)
    spread = loads.std(axis=0)
    clear = max(_LOADED * float(spread.max(initial=0.0)), _LEAST_LOAD)
    keys = ("gravity_compliance", *LATERAL)
    return frozenset(f"{model.joints[i].name}.{keys[k]}" for i, k in np.argwhere(spread > clear))


def moving_joints(model: RobotModel, poses: PoseSet) -> list[int]:
    """Joints that move any measured target or carried instrument, those between it and the base and those that these follow."""
    return carrying_joints(model, poses.targets, poses.stations)


def carrying_joints(model: RobotModel, targets: Sequence[str], stations: Sequence[str]) -> list[int]:
    """Joints that move any of the `targets` or of the instruments on the robot among the `stations`, in chain order."""
    ends = [model.point(target).joint for target in targets]
    ends += [model.carriers[name].joint for name in stations if name in model.carriers]
    return sorted({i for end in ends for i in model.moving(end)})


def _keys(kind: str) -> tuple[str, ...]:
    if kind == "lateral_compliance":
        return LATERAL
    return (f"{kind}_sin", f"{kind}_cos") if kind.startswith("transmission_") else (kind,)


def manufacturing_tolerances(parameters: Parameters) -> np.ndarray:
    """Size of a relevant change of each geometric parameter (p,), natural units."""
    return np.array([TOLERANCE[p.unit] for p in parameters])


def common_lengths(model: RobotModel, parameters: Parameters) -> np.ndarray:
    """Nominal lengths (p,), m, of links of which those of the `parameters` that have a prior are a change; zero for all others.

    A robot that is larger by a factor has each of these errors in proportion to them.
    """
    owners = {name.rpartition(".")[0] for name in parameters.names}
    ahead: dict[str, np.ndarray] = {}
    for joint in model.joints:
        if joint.name in owners and joint.parent >= 0:
            ahead.setdefault(model.joints[joint.parent].name, joint.translation)
    return np.array(
        [
            float(ahead[owner]["xyz".index(key[-1])])
            if np.isfinite(item.prior_std) and key.startswith("length_") and owner in ahead
            else 0.0
            for item in parameters
            for owner, _, key in (item.name.rpartition("."),)
        ]
    )


def _parameter(model: RobotModel, name: str, lower: float = -np.inf) -> Parameter:
    std = declared_size(model, name) or np.inf
    return Parameter(name, unit_in(model, name), model.value(name), lower=lower, prior_std=std)


_PLAUSIBLE = {
    "offset": 5e-3,
    "misalignment_1": 2e-3,
    "misalignment_2": 2e-3,
    "backlash": 1e-3,
    HYSTERESIS: 7e-5,
}
_PLAUSIBLE_LENGTH, _PLAUSIBLE_POINT, _PLAUSIBLE_STATION = 1e-3, 1e-2, 1.0
_PLAUSIBLE_COMPLIANCE, _PLAUSIBLE_TRANSMISSION = 1e-4, 1e-3
_PLAUSIBLE_RATIO = 1e-3


def plausible_size(model: RobotModel, name: str) -> float:
    """Plausible deviation of a geometric parameter from its nominal value (1σ, natural units).

    What robot.yaml declares under `prior:` comes first; else joint offsets 5 mrad, misalignments 2 mrad, lengths 1 mm, the place of a
    reflector on the tool 10 mm, the instrument 1 m or rad, and so the rotations of a joint at the base, which take up that of the first
    station; half a backlash and a wave of a transmission error 1 mrad, half the width of a hysteresis 70 µrad, the root mean
    square of 15 to 145 µrad, between which industrial gears have it, equally likely by its logarithm; compliances 0.1 mrad/(N m), the
    softest of small arms; ratios 1 ‰; what changes with temperature as `plausible_thermal_size` says.
    """
    declared = declared_size(model, name)
    if declared is not None:
        return declared
    owner, _, key = name.rpartition(".")
    thermal = plausible_thermal_size(key)
    if thermal is not None:
        return thermal
    if owner.startswith("station.") or (owner.startswith("point.") and key in STATION[3:]):
        return _PLAUSIBLE_STATION
    if owner.startswith("point.") or (owner == "tool" and key.startswith("length")):
        return _PLAUSIBLE_POINT
    if key.startswith("transmission_"):
        return _PLAUSIBLE_TRANSMISSION
    if key.startswith(RATIO):
        return _PLAUSIBLE_RATIO * declared_ratio(model, owner, key.removeprefix(RATIO))
    if key.startswith("gravity_compliance"):
        return _PLAUSIBLE_COMPLIANCE
    if key.startswith(("length", "origin")) or key in LOOP:
        return _PLAUSIBLE_LENGTH
    of_drive = key in ("backlash", HYSTERESIS)
    return _PLAUSIBLE_STATION if _is_at_base(model, owner) and not of_drive else _PLAUSIBLE[key]


def declared_ratio(model: RobotModel, joint: str, other: str) -> float:
    """Size of the declared ratio of a joint's motion to that of another, or to that of its own motor."""
    i, k = model.joint_index(joint), model.joint_index(other)
    relations = model.relations
    return 1.0 if relations is None or i == k else abs(float(relations.ratios[i, k]))


def declared_size(model: RobotModel, name: str) -> float | None:
    """Standard deviation of a geometric parameter in robot.yaml's `prior:`, by name or by kind; None if not given."""
    prior, (owner, _, key) = model.prior, name.rpartition(".")
    for kind in KINDS:
        scale = kind.scale_std(model, name)
        if scale is not None:
            return scale
    if name in prior.parameters:
        return prior.parameters[name]
    if key in LOOP:
        return prior.length
    if owner not in model.joint_names or key not in (*GEOMETRY, *ORIGIN):
        return None
    return prior.angle if unit_in(model, name) == "rad" else prior.length
