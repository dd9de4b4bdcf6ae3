"""Reading of robot.yaml and URDF into a robot model."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.files.formats import YamlFile
from flexcal.files.structuring import suggestion
from flexcal.model.parts import (
    LOOP,
    ForceSensor,
    Joint,
    Payload,
    Point,
    Relations,
    bearing_frame,
    joints_that_move,
    rpy_rotation,
)
from flexcal.model.robot.arm_sensor import ArmSensor
from flexcal.model.robot.config import RobotConfig
from flexcal.model.robot.drive_config import ElasticConfig
from flexcal.model.robot.joint_relations import read_relations
from flexcal.model.robot.parameter_groups import Drives, Geometry, Links, Scatter, Springs, Stations, Thermal
from flexcal.model.robot.parameter_names import COUPLED, FRICTION_PARAMETERS, PARALLEL, SCATTER
from flexcal.model.urdf import Description, Frame, read_urdf

if TYPE_CHECKING:
    from flexcal.model.robot.robot_model import RobotModel

HARMONICS = (1, 2, 3, 5, 8, 13)
"""Orders of transmission errors; the higher ones stand for those between them too."""


def read_robot(robot_type: type[RobotModel], file: YamlFile) -> RobotModel:
    """Robot model of a robot.yaml and its URDF; raises `InputError` with file and line for inconsistent content."""
    config = file.structure(RobotConfig)
    urdf = file.path.parent / config.robot
    description = read_urdf(urdf, config.locked)
    joints = description.joints
    relations = read_relations(file, config, description)
    motors = tuple(range(len(joints))) if relations is None else relations.motors
    n = len(joints)
    names = [joint.name for joint in joints]
    for k, name in enumerate(config.geometry.backlash):
        _joint(file, ("geometry", "backlash", k), names, name)
    for k, coupling in enumerate(config.drives.coupling):
        _joint(file, ("drives", "coupling", k, "motor"), names, coupling.motor)
        _joint(file, ("drives", "coupling", k, "joint"), names, coupling.joint)
    for key in ("joint_springs", "cable_torques"):
        entries = getattr(config.dynamics, key)
        for k, entry in enumerate(entries):
            _joint(file, ("dynamics", key, k, "joint"), names, entry.joint)
            if entry.joint in {other.joint for other in entries[:k]}:
                raise file.error(
                    "E-ROBOT-024",
                    ("dynamics", key, k),
                    f"the joint '{entry.joint}' stands twice under `{key}:`; keep one.",
                )
    for key in ("kp", "kd") if config.controller is not None else ():
        _check_count(file, ("controller", key), getattr(config.controller, key), len(motors))
    if config.limits.acceleration is not None:
        _check_count(file, ("limits", "acceleration"), config.limits.acceleration, len(motors))
    points = {name: _point(file, description, name, config) for name in config.points}
    points |= _inclinometers(file, description, config)
    payload = _payload(file, description, config)
    springs = _springs(file, config, joints, points, relations)
    stations = tuple(config.stations) or ("tracker",)
    return robot_type(
        config=config,
        path=file.path,
        urdf=urdf,
        name=description.name,
        joints=joints,
        points=points,
        geometry=Geometry(
            errors=np.zeros((n, 6)),
            origin_error=np.zeros((n, 3)),
            tool=np.zeros(6),
            point_error=np.zeros((len(points), 3)),
            point_turn=np.zeros((len(points), 3)),
            point_zero=np.zeros((len(points), 3)),
            gravity_compliance=np.zeros(n),
            lateral_compliance=np.zeros((n, 2)),
            loops=np.zeros((len(config.loops), len(LOOP))),
        ),
        springs=springs,
        drives=_drives(file, config, n, motors),
        links=Links.of(description.inertias),
        stations=Stations.at_base(
            stations, [name for name, item in config.measurements.items() if item.kind == "sockets"]
        ),
        scatter=Scatter(np.zeros(len(SCATTER)), np.zeros(n)),
        thermal=Thermal.at_reference(n, config.geometry.reference_temperature),
        payload=payload,
        force_sensor=_force_sensor(file, description, config),
        carriers={
            name: _carrier(file, description, name, config)
            for name, entry in config.stations.items()
            if entry.frame is not None
        },
        sensors={name: _sensor(file, description, name, config) for name in config.sensors},
        relations=relations,
    )


def _springs(
    file: YamlFile,
    config: RobotConfig,
    joints: Sequence[Joint],
    points: Mapping[str, Point],
    relations: Relations | None,
) -> Springs:
    n, names = len(joints), [joint.name for joint in joints]
    stiffness, damping = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    bearing_frames: dict[int, np.ndarray] = {}
    carrying = {i for p in points.values() for i in joints_that_move(joints, relations, p.joint)}
    for k, entry in enumerate(config.elastic):
        i = _joint(file, ("elastic", k, "joint"), names, entry.joint)
        if i in bearing_frames:
            raise file.error(
                "E-ROBOT-025",
                ("elastic", k),
                f"the joint '{entry.joint}' stands twice under `elastic:`; keep one.",
            )
        if points and i not in carrying:
            seen = ", ".join(points)
            raise file.error(
                "E-ROBOT-026",
                ("elastic", k),
                f"no declared point ({seen}) is downstream of the elastic joint '{entry.joint}'; "
                "declare a point that it moves, or remove the joint from `elastic:`.",
            )
        if relations is not None and i in relations.passive:
            raise file.error(
                "E-ROBOT-073",
                ("elastic", k),
                f"a loop determines the joint '{entry.joint}', so no drive holds it; remove it from `elastic:`.",
            )
        bearing_frames[i] = _bearing_frame(file, k, entry, joints[i])
        stiffness[i, 2], damping[i, 2] = entry.drive.stiffness, entry.drive.damping
        for c, spring in enumerate((entry.bearing_x, entry.bearing_y)):
            if spring is not None:
                stiffness[i, c], damping[i, c] = spring.stiffness, spring.damping
    return Springs(bearing_frames, stiffness, damping, hardening=np.zeros(n))


def _drives(file: YamlFile, config: RobotConfig, n: int, motors: Sequence[int]) -> Drives:
    def declared(key: str) -> np.ndarray:
        values = np.full(n, np.nan)
        values[list(motors)] = _per_motor(file, config, key, len(motors))
        return values

    return Drives(
        rotor_inertia=declared("rotor_inertia"),
        held_inertia=np.zeros(n),
        viscous=declared("viscous"),
        coulomb=declared("coulomb"),
        torque_offset=np.zeros(n),
        friction=np.zeros((n, len(FRICTION_PARAMETERS))),
        parallel=np.zeros((n, len(PARALLEL))),
        coupling=np.zeros((len(config.drives.coupling), len(COUPLED))),
        delay=np.zeros(n),
        drive_gain=np.ones(n),
        ratio=declared("ratio"),
        backlash=np.zeros(n),
        hysteresis=np.zeros(n),
        transmission=np.zeros((n, len(HARMONICS), 2)),
        ratio_error=np.zeros((n, n)),
        harmonics=HARMONICS,
    )


def _joint(file: YamlFile, keys: tuple[str | int, ...], names: list[str], name: str) -> int:
    if name not in names:
        raise file.error(
            "E-ROBOT-027", keys, f"the URDF has no movable joint '{name}'; it has {', '.join(names)}."
        )
    return names.index(name)


def _frame(file: YamlFile, keys: tuple[str | int, ...], description: Description, name: str) -> Frame:
    frame = description.frames.get(name)
    if frame is None:
        known = [f for f in description.frames if f != "universe"]
        near = suggestion(name, known) or f"; it has {', '.join(known)}."
        raise file.error("E-ROBOT-028", keys, f"the URDF lacks the frame '{name}'{near}")
    if frame.joint < 0:
        raise file.error(
            "E-ROBOT-029",
            keys,
            f"the frame '{name}' does not move with any joint; name one beyond the first joint.",
        )
    return frame


def _point(file: YamlFile, description: Description, name: str, config: RobotConfig) -> Point:
    entry = config.points[name]
    frame = _frame(file, ("points", name, "frame"), description, entry.frame)
    return Point(name, entry.frame, frame.joint, frame.rotation, frame.translation, np.array(entry.xyz))


def _carrier(file: YamlFile, description: Description, station: str, config: RobotConfig) -> Point:
    """Nominal place of a station's instrument in the frame that carries it."""
    entry, touched = config.stations[station], config.measurements.get(station)
    assert entry.frame is not None
    if getattr(touched, "xyz", None) is not None:
        raise file.error(
            "E-ROBOT-061",
            ("measurements", station, "xyz"),
            f"'{station}' moves with {entry.frame}, so it has no place in the base frame; give its xyz in the axes of {entry.frame} under "
            "`stations:`.",
        )
    frame = _frame(file, ("stations", station, "frame"), description, entry.frame)
    xyz = np.array(entry.xyz or (0.0, 0.0, 0.0))
    return Point(station, entry.frame, frame.joint, frame.rotation, frame.translation, xyz)


def _inclinometers(file: YamlFile, description: Description, config: RobotConfig) -> dict[str, Point]:
    """Inclinometers as points at the origin of the frame that they are mounted on, turned as declared."""
    points = {}
    for name, entry in config.measurements.items():
        if entry.kind != "inclinometer":
            continue
        if name in config.points:
            raise file.error(
                "E-ROBOT-077",
                ("measurements", name),
                f"'{name}' is a point under `points:` too; give the inclinometer another name.",
            )
        frame = _frame(file, ("measurements", name, "frame"), description, entry.frame)
        rotation = frame.rotation @ rpy_rotation(np.array(entry.rpy or (0.0, 0.0, 0.0)))
        points[name] = Point(name, entry.frame, frame.joint, rotation, frame.translation, np.zeros(3))
    return points


_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def _sensor(file: YamlFile, description: Description, name: str, config: RobotConfig) -> ArmSensor:
    entry = config.sensors[name]
    frame = _frame(file, ("sensors", name, "frame"), description, entry.frame)
    if not re.fullmatch(r"\w+", name):
        raise file.error(
            "E-ROBOT-030",
            ("sensors", name),
            f"the sensor's name '{name}' may have letters, digits and _ only.",
        )
    moves = entry.kind == "accelerometer"
    direction = np.array(entry.direction) / np.linalg.norm(entry.direction)
    quantity = entry.quantity or ("acceleration" if moves else "velocity")
    return ArmSensor(
        name,
        frame.joint,
        frame.translation + frame.rotation @ np.array(entry.xyz),
        frame.rotation @ direction if moves else direction,
        moves,
        _ORDERS[quantity],
        entry,
    )


def _payload(file: YamlFile, description: Description, config: RobotConfig) -> Payload | None:
    entry = config.payload
    if entry is None:
        return None
    frame = _frame(file, ("payload", "frame"), description, entry.frame)
    com = np.array(entry.com)
    inertia = np.zeros((3, 3)) if entry.inertia is None else np.array(entry.inertia)
    if np.linalg.eigvalsh(inertia)[0] < 0 or np.abs(inertia - inertia.T).max() > 0:
        raise file.error(
            "E-ROBOT-031", ("payload", "inertia"), "the payload's inertia must be symmetric and positive."
        )
    return Payload(
        entry.frame,
        frame.joint,
        frame.rotation,
        frame.translation,
        entry.mass,
        entry.mass,
        entry.mass_std,
        com,
        inertia,
    )


def _force_sensor(file: YamlFile, description: Description, config: RobotConfig) -> ForceSensor | None:
    entry = config.force_sensor
    if entry is None:
        return None
    frame = _frame(file, ("force_sensor", "frame"), description, entry.frame)
    return ForceSensor(
        frame.joint,
        frame.rotation @ rpy_rotation(np.array(entry.rpy)),
        frame.translation + frame.rotation @ np.array(entry.xyz),
        1.0 if entry.wrench == "on_robot" else -1.0,
    )


def _bearing_frame(file: YamlFile, k: int, entry: ElasticConfig, joint: Joint) -> np.ndarray:
    if joint.kind != "revolute":
        raise file.error(
            "E-ROBOT-032",
            ("elastic", k, "joint"),
            f"the joint '{joint.name}' is prismatic; only revolute joints can be elastic.",
        )
    if entry.frame_rpy is None:
        return bearing_frame(joint)
    frame = joint.rotation.T @ rpy_rotation(np.array(entry.frame_rpy))
    if frame[:, 2] @ joint.axis < 1 - 1e-6:
        raise file.error(
            "E-ROBOT-033",
            ("elastic", k, "frame_rpy"),
            f"the z axis of frame_rpy is not the axis of '{joint.name}'; turn it so that it is, or leave frame_rpy out.",
        )
    return frame


def _per_motor(file: YamlFile, config: RobotConfig, key: str, n: int) -> np.ndarray:
    values = getattr(config.drives, key)
    if values is None:
        return np.full(n, np.nan)
    _check_count(file, ("drives", key), values, n)
    if key != "ratio" and min(values) < 0:
        raise file.error(
            "E-ROBOT-034", ("drives", key), f"{key} must not be negative, but is {min(values):g}."
        )
    if key == "ratio" and 0 in values:
        raise file.error(
            "E-ROBOT-035", ("drives", key), "a ratio of 0 is not possible; give motor turns per joint turn."
        )
    return np.array(values)


def _check_count(file: YamlFile, keys: tuple[str, str], values: Sequence[float], n: int) -> None:
    if len(values) != n:
        raise file.error(
            "E-ROBOT-036",
            keys,
            f"{keys[1]} has {len(values)} entries but the robot has {n} joints; give one per joint.",
        )
