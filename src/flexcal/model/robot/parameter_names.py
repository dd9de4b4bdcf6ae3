"""Table of parameter names (docs/file-formats.md): location in `RobotModel` and unit of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.model.parts import LOOP
from flexcal.model.robot.parameter_groups import Location

if TYPE_CHECKING:
    from flexcal.model.robot.robot_model import RobotModel

GEOMETRY = ("offset", "misalignment_1", "misalignment_2", "length_x", "length_y", "length_z")
RATIO = "ratio_"
"""What a joint moves more than declared per motion of another, whose name follows, or of its own motor."""
EXPANSION, REFERENCE = "thermal.expansion", "thermal.reference"
"""Linear expansion coefficient of the arm, and the temperature at which the other parameters hold."""
LINK_EXPANSION, ZERO_DRIFT = "thermal_expansion", "thermal_drift"
"""Keys of a link's own expansion beyond the arm's, and of the drift of a joint's zero with temperature."""
HYSTERESIS = "hysteresis"
"""Key of half the width by which a joint lags behind the last motion of its motor."""
STATION_DRIFT = ("thermal_x", "thermal_y", "thermal_z")
"""Shift of an instrument's readings with temperature."""
ORIGIN = ("origin_x", "origin_y", "origin_z")
"""Displacement of a joint that branches off, in its parent link."""
SPRINGS = ("bearing_x", "bearing_y", "drive")
LATERAL = ("gravity_compliance_1", "gravity_compliance_2")
_FRICTION_UNITS = {
    "coulomb_asymmetry": "N m",
    "sublinear_viscous": "N m √(s/rad)",
    "load_coulomb": "1",
    "load_stribeck": "1",
    "stribeck": "N m",
    "presliding": "N m",
    "warm_up": "N m s/rad",
    "coulomb_warm_up": "N m",
    "cable_stiffness": "N m/rad",
}
FRICTION_PARAMETERS = tuple(_FRICTION_UNITS)
"""Parameters of the friction terms beyond viscous and Coulomb friction, `<joint>.<key>`."""
PARALLEL = ("spring_stiffness", "spring_torque", "cable_torque")
COUPLED = ("rotor_inertia", "viscous", "coulomb")
DRIVE_GAIN = "drive_gain"
"""Key of the factor of a joint's true torque to that of the log: the torque constant over the one that the controller has."""
MASS_AND_COM = ("mass", "com_x", "com_y", "com_z")
MOMENTS = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
STATION = ("x", "y", "z", "rx", "ry", "rz")
VERTICAL = "vertical"
"""Station whose z axis is the vertical, by which inclinometers read."""
ZEROS = ("zero_x", "zero_y", "zero_z")
BOARD_SCALE = "board.scale"
"""Relative deviation of the size of a camera's board from the declared one."""
LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Intrinsic parameters of a camera."""
SCATTER = (
    "instrument",
    "instrument_share",
    "robot",
    "angular",
    "model",
    "pose",
    "transmission",
    "orientation",
)

_UNITS = {
    **dict.fromkeys(LOOP, "m"),
    **dict.fromkeys(("zero_x", "zero_y", "zero_z"), "rad"),
    "expansion": "1/K", "thermal_expansion": "1/K", "thermal_drift": "rad/K", "reference": "°C",
    **dict.fromkeys(("thermal_x", "thermal_y", "thermal_z"), "m/K"),
    "offset": "rad", "misalignment_1": "rad", "misalignment_2": "rad", "length_x": "m", "length_y": "m", "length_z": "m",
    "origin_x": "m", "origin_y": "m", "origin_z": "m",
    "x": "m", "y": "m", "z": "m", "zero": "m", "rx": "rad", "ry": "rad", "rz": "rad", "backlash": "rad", HYSTERESIS: "rad",
    "gravity_compliance": "rad/(N m)",
    "gravity_compliance_1": "rad/(N m)", "gravity_compliance_2": "rad/(N m)",
    "stiffness": "N m/rad", "damping": "N m s/rad",
    "rotor_inertia": "kg m²", "armature": "kg m²", "viscous": "N m s/rad", "coulomb": "N m",
    "spring_stiffness": "N m/rad", "spring_torque": "N m", "cable_torque": "N m",
    **dict.fromkeys(("fx_offset", "fy_offset", "fz_offset"), "N"), **dict.fromkeys(("mx_offset", "my_offset", "mz_offset"), "N m"),
    "torque_offset": "N m", "delay": "s", "mass": "kg", "com_x": "m", "com_y": "m", "com_z": "m",
    "held_inertia": "kg m²", "arm_inertia": "kg m²", "arm_viscous": "N m s/rad", "arm_coulomb": "N m", "gap_torque": "N m",
    **_FRICTION_UNITS, "mc_x": "kg m", "mc_y": "kg m", "mc_z": "kg m",
    **dict.fromkeys(("position_x", "position_y", "position_z"), "m"), "direction_1": "rad", "direction_2": "rad",
    **dict.fromkeys(("fx", "fy", "cx", "cy"), "px"),
    "instrument": "m", "robot": "m", "angular": "rad", "model": "m", "pose": "m", "transmission": "rad", "orientation": "rad",
}  # fmt: skip


_OF_DRIVES = ("rotor_inertia", "viscous", "coulomb", "torque_offset", *FRICTION_PARAMETERS, *PARALLEL)
_SLIDING = {
    "kg m²": "kg", "N m": "N", "N m/rad": "N/m", "N m s/rad": "N s/m", "N m √(s/rad)": "N √(s/m)",
}  # fmt: skip


_OF_POSITIONS = ("offset", "backlash", HYSTERESIS, "transmission_", ZERO_DRIFT)


def unit_in(model: RobotModel, name: str) -> str:
    """SI unit of a robot's parameter; positions, drive, spring and friction of a prismatic joint are in m and N."""
    unit, (owner, _, key) = unit_of(name), name.rpartition(".")
    if owner in model.joint_names and key.startswith(RATIO):
        kinds = [model.joints[model.joint_index(j)].kind for j in (owner, key.removeprefix(RATIO))]
        return "1" if kinds[0] == kinds[1] else "m/rad" if kinds[0] == "prismatic" else "rad/m"
    key, _, other = key.partition("_at_")
    if owner not in model.joint_names or not key.startswith((*_OF_POSITIONS, *_OF_DRIVES)):
        return unit
    slides = [model.joints[model.joint_index(j)].kind == "prismatic" for j in (owner, other or owner)]
    return ({"rad": "m", "rad/K": "m/K"} | _SLIDING).get(unit, unit) if all(slides) else unit


def geometric_errors(model: RobotModel, joints: Sequence[int]) -> list[str]:
    """Names of the geometric errors of some `joints`, in chain order, and of the loops that determine any of them.

    Where several of them are on one link its length vector places them together, and each but the first has an origin of its own.
    """
    parents = [model.joints[i].parent for i in joints]
    branching = [i for k, i in enumerate(joints) if parents[k] in parents[:k]]
    loops = () if model.relations is None else model.relations.loops
    own = [loop for loop in loops if not set(loop.passive).isdisjoint(joints)]
    return [
        *(f"{model.joints[i].name}.{key}" for i in joints for key in GEOMETRY),
        *(f"{model.joints[i].name}.{key}" for i in branching for key in ORIGIN),
        *(f"loop.{loop.name}.{key}" for loop in own for key in loop.errors),
    ]


def ratio_errors(model: RobotModel, joint: int) -> tuple[int, ...]:
    """Joints by whose motion a joint may move more or less than declared: those it follows, and a slide's own motor."""
    own = model.joints[joint].kind == "prismatic" and joint in model.motors
    followed = () if model.relations is None else np.flatnonzero(model.relations.ratios[joint]).tolist()
    return (*((joint,) if own else ()), *followed)


def socket_scale(fixture: str) -> str:
    """Parameter that is the relative deviation of the distances between a fixture's sockets from the declared ones."""
    return f"sockets.{fixture}.scale"


def torque_units(model: RobotModel) -> dict[str, str]:
    """SI unit of the torque, or force, of every joint."""
    return {joint.name: "N" if joint.kind == "prismatic" else "N m" for joint in model.joints}


def unit_of(name: str) -> str:
    """SI unit of a parameter name, for revolute joints."""
    last = name.rpartition(".")[2].partition("_at_")[0]
    if last.startswith("transmission_"):
        return "rad"
    if last.startswith("I") and len(last) == 3:
        return "kg m²"
    return _UNITS.get(last, "1")


def spring_names(model: RobotModel) -> tuple[str, ...]:
    """Names of the stiffness, then of the damping of every spring, joint by joint: drive, bearing_x, bearing_y."""
    springs = [
        f"{joint.name}.{SPRINGS[c]}"
        for joint in model.elastic
        for c in ((2, 0, 1) if joint.bearings else (2,))
    ]
    return tuple(f"{spring}.{kind}" for kind in ("stiffness", "damping") for spring in springs)


def unknown_parallel(model: RobotModel, joint: str) -> tuple[str, ...]:
    """Effects out of `PARALLEL` that robot.yaml declares on a joint without a value."""
    config = model.config.dynamics
    springs = [entry for entry in config.joint_springs if entry.joint == joint]
    unknown = ["spring_stiffness"] if any(entry.stiffness is None for entry in springs) else []
    unknown += ["spring_torque"] if any(entry.rest is None for entry in springs) else []
    unknown += (
        ["cable_torque"] if any(e.joint == joint and e.torque is None for e in config.cable_torques) else []
    )
    return tuple(unknown)


def parameter_locations(model: RobotModel) -> dict[str, Location]:
    """Location of every named parameter of a robot in its groups of arrays.

    The payload's are not here, for it keeps its own (`Payload.values`), nor are inertia entries of links (`<link>.Ixx`…, at the joint
    frame) and first moments (`<link>.mc_x`…), which depend on mass and centre of mass too.
    """
    table: dict[str, Location] = {}
    for s, name in enumerate(model.stations.names):
        for k, key in enumerate(STATION):
            table[f"station.{name}.{key}"] = Location("stations", "pose", (s, k))
        table[f"station.{name}.zero"] = Location("stations", "zero", (s,))
        table[f"station.{name}.scale"] = Location("stations", "wire_scale", (s,))
        for k, key in enumerate(STATION_DRIFT):
            table[f"station.{name}.{key}"] = Location("stations", "drift", (s, k))
    table[EXPANSION] = Location("thermal", "expansion", (0,))
    table[REFERENCE] = Location("thermal", "reference", (0,))
    table[BOARD_SCALE] = Location("stations", "board_scale", (0,))
    for k, name in enumerate(model.stations.fixtures):
        table[socket_scale(name)] = Location("stations", "socket_scale", (k,))
    for c, name in enumerate(model.lenses.names):
        for k, key in enumerate(LENS):
            table[f"camera.{name}.{key}"] = Location("lenses", "values", (c, k))
    for i, loop in enumerate(() if model.relations is None else model.relations.loops):
        for key in loop.errors:
            table[f"loop.{loop.name}.{key}"] = Location("geometry", "loops", (i, LOOP.index(key)))
    elastic, branching = {e.index: e for e in model.elastic}, model.branching
    for i, joint in enumerate(model.joints):
        for k, key in enumerate(GEOMETRY):
            table[f"{joint.name}.{key}"] = Location("geometry", "errors", (i, k))
        for k, key in enumerate(ORIGIN if i in branching else ()):
            table[f"{joint.name}.{key}"] = Location("geometry", "origin_error", (i, k))
        table[f"{joint.name}.backlash"] = Location("drives", "backlash", (i,))
        table[f"{joint.name}.{HYSTERESIS}"] = Location("drives", HYSTERESIS, (i,))
        table[f"{joint.name}.gravity_compliance"] = Location("geometry", "gravity_compliance", (i,))
        for k, key in enumerate(LATERAL):
            table[f"{joint.name}.{key}"] = Location("geometry", "lateral_compliance", (i, k))
        for h, order in enumerate(model.drives.harmonics):
            for k, key in enumerate(("sin", "cos")):
                table[f"{joint.name}.transmission_{order}_{key}"] = Location(
                    "drives", "transmission", (i, h, k)
                )
        for k in ratio_errors(model, i):
            table[f"{joint.name}.{RATIO}{model.joints[k].name}"] = Location("drives", "ratio_error", (i, k))
        table[f"{joint.name}.{ZERO_DRIFT}"] = Location("thermal", "zero_drift", (i,))
        table[f"{joint.link}.{LINK_EXPANSION}"] = Location("thermal", "link_expansion", (i,))
        for key in ("rotor_inertia", "viscous", "coulomb", "torque_offset", "delay", DRIVE_GAIN):
            table[f"{joint.name}.{key}"] = Location("drives", key, (i,))
        for key in unknown_parallel(model, joint.name):
            table[f"{joint.name}.{key}"] = Location("drives", "parallel", (i, PARALLEL.index(key)))
        for k, key in enumerate(FRICTION_PARAMETERS):
            table[f"{joint.name}.{key}"] = Location("drives", "friction", (i, k))
        if i in elastic:
            for k, key in enumerate(SPRINGS):
                if key == "drive" or elastic[i].bearings:
                    table[f"{joint.name}.{key}.stiffness"] = Location("springs", "stiffness", (i, k))
                    table[f"{joint.name}.{key}.damping"] = Location("springs", "damping", (i, k))
            table[f"{joint.name}.drive.hardening"] = Location("springs", "hardening", (i,))
        if i in model.springs.braked:
            table[f"{joint.name}.held_inertia"] = Location("drives", "held_inertia", (i,))
        table[f"{joint.link}.mass"] = Location("links", "mass", (i,))
        for k, key in enumerate("xyz"):
            table[f"{joint.link}.com_{key}"] = Location("links", "com", (i, k))
    for c, entry in enumerate(model.config.drives.coupling):
        for k, key in enumerate(COUPLED):
            table[f"{entry.motor}.{key}_at_{entry.joint}"] = Location("drives", "coupling", (c, k))
    for k, key in enumerate(GEOMETRY):
        table[f"tool.{key}"] = Location("geometry", "tool", (k,))
    for p, name in enumerate(model.points):
        for k, key in enumerate("xyz"):
            table[f"point.{name}.{key}"] = Location("geometry", "point_error", (p, k))
            table[f"point.{name}.r{key}"] = Location("geometry", "point_turn", (p, k))
            table[f"point.{name}.zero_{key}"] = Location("geometry", "point_zero", (p, k))
    for k, key in enumerate(SCATTER):
        table[f"scatter.{key}"] = Location("scatter", "std", (k,))
    for i, joint in enumerate(model.joints):
        table[f"scatter.{joint.name}.angular"] = Location("scatter", "joints", (i,))
    return table
