"""Joint relations of robot.yaml and URDF: which joints have motors, and how the others follow them."""

from __future__ import annotations

import numpy as np

from flexcal.files.formats import YamlFile
from flexcal.files.structuring import suggestion
from flexcal.model.parts import (
    Joint,
    Loop,
    LoopEnd,
    Relations,
    carried,
    common_joint,
    normals_to,
    path_to,
)
from flexcal.model.robot.config import RobotConfig
from flexcal.model.urdf import Description

_PARALLEL = 1e-6
"""Largest sine of the angle between the axes of a planar loop, nominally."""


def read_relations(file: YamlFile, config: RobotConfig, description: Description) -> Relations | None:
    """Relations of the joints; None where every joint has a motor. Raises `InputError` with file and line for what contradicts itself.

    A relation of robot.yaml stands in the place of a <mimic> of the same joint.
    """
    joints, names = description.joints, [joint.name for joint in description.joints]
    ratios = {names.index(j): {names.index(m[0]): m[1]} for j, m in description.mimics.items()}
    shift = np.zeros(len(joints))
    for name, mimic in description.mimics.items():
        shift[names.index(name)] = mimic[2]
    own = np.ones(len(joints))
    own[list(ratios)] = 0.0
    for k, entry in enumerate(config.relations):
        joint = _index(file, ("relations", k, "joint"), names, entry.joint)
        if entry.joint in {other.joint for other in config.relations[:k]}:
            raise file.error(
                "E-ROBOT-065",
                ("relations", k),
                f"the joint '{entry.joint}' stands twice under `relations:`; keep one.",
            )
        of = {_index(file, ("relations", k, "of", name), names, name): r for name, r in entry.of.items()}
        own[joint] = of.pop(joint, 0.0)
        ratios[joint], shift[joint] = of, entry.offset
    carry = carried(ratios, len(joints))
    if carry is None:
        around = ", ".join(names[i] for i in ratios)
        raise file.error(
            "E-ROBOT-066",
            ("relations",) if config.relations else (),
            f"the relations of {around} go round in a circle, so nothing moves them; a joint follows others that have motors.",
        )
    loops: list[Loop] = []
    for name in config.loops:
        loops.append(_loop(file, name, config, description))
        for joint in loops[-1].passive:
            if not own[joint]:
                raise file.error(
                    "E-ROBOT-067",
                    ("loops", name, "passive"),
                    f"the joint '{names[joint]}' follows a relation or another loop already; name another one.",
                )
            own[joint] = 0.0
    if not ratios and not loops:
        return None
    motors = _ordered(file, config, description, np.flatnonzero(own).tolist())
    by_motor = np.zeros((len(joints), len(motors)))
    by_motor[list(motors), range(len(motors))] = own[list(motors)]
    return Relations(motors, by_motor, carry, shift, tuple(loops))


def _ordered(
    file: YamlFile, config: RobotConfig, description: Description, motors: list[int]
) -> tuple[int, ...]:
    """Motors in the order of the columns q1, q2, …: that of `motors:`, or from the base on where they stand in one chain."""
    joints, names = description.joints, [description.joints[i].name for i in motors]
    if not motors:
        raise file.error("E-ROBOT-068", (), "every joint follows others, and none has a motor.")
    if config.motors:
        if sorted(config.motors) != sorted(names):
            raise file.error(
                "E-ROBOT-074",
                ("motors",),
                f"the joints with motors are {', '.join(names)}; list each of them once.",
            )
        return tuple(motors[names.index(name)] for name in config.motors)
    ways = [set(path_to(joints, i)) for i in range(len(joints))]
    if not any(way.issuperset(motors) for way in ways):
        deepest = max(ways, key=lambda way: len(way.intersection(motors)))
        beside = next(joints[i].name for i in motors if i not in deepest)
        raise file.error(
            "E-ROBOT-075",
            (),
            f"the motor of '{beside}' does not stand in one chain with the others, so the order of the columns q1 … q{len(motors)} is not "
            f"evident; say it, as `motors: [{', '.join(sorted(names))}]`.",
        )
    return tuple(motors)


def _index(file: YamlFile, keys: tuple[str | int, ...], names: list[str], name: str) -> int:
    if name not in names:
        near = suggestion(name, names) or f"; it has {', '.join(names)}."
        raise file.error("E-ROBOT-069", keys, f"the URDF has no movable joint '{name}'{near}")
    return names.index(name)


def _loop(file: YamlFile, name: str, config: RobotConfig, description: Description) -> Loop:
    entry, joints = config.loops[name], description.joints
    names = [joint.name for joint in joints]
    ends: list[LoopEnd] = []
    for key, frame in (("a", entry.a), ("b", entry.b)):
        end = description.frames.get(frame)
        if end is None:
            near = suggestion(frame, list(description.frames)) or "."
            raise file.error("E-ROBOT-070", ("loops", name, key), f"the URDF lacks the frame '{frame}'{near}")
        ends.append(LoopEnd(end.joint, end.rotation, end.translation))
    paths = [path_to(joints, end.joint) for end in ends]
    around = set(paths[0]) ^ set(paths[1])
    passive = tuple(_index(file, ("loops", name, "passive", j), names, j) for j in entry.passive)
    ground = common_joint(*paths)
    if not around.issuperset(passive) or len(around) < len(passive):
        outside = next((joint for joint in passive if joint not in around), passive[0])
        raise file.error(
            "E-ROBOT-071",
            ("loops", name, "passive"),
            f"the joint '{names[outside]}' is not between '{entry.a}' and '{entry.b}', so this loop cannot determine it.",
        )
    return Loop(
        name,
        ends[0],
        ends[1],
        ground,
        tuple(sorted(around)),
        passive,
        _rows(file, name, passive, sorted(around), joints, ground),
        np.array(list(entry.passive.values())),
        tuple(
            f"{key}_{axis}"
            for key, end in zip("ab", ends, strict=True)
            for axis in "xyz"
            if _carries(config, description, end.joint)
        ),
    )


def _carries(config: RobotConfig, description: Description, joint: int) -> bool:
    """Whether a joint's link carries a further joint or a point, so that a length of its own does not say where its end of a loop is."""
    frames = [description.frames.get(point.frame) for point in config.points.values()]
    hung = {frame.joint for frame in frames if frame is not None}
    return joint in hung or any(other.parent == joint for other in description.joints)


def _rows(
    file: YamlFile,
    name: str,
    passive: tuple[int, ...],
    around: list[int],
    joints: tuple[Joint, ...],
    ground: int,
) -> np.ndarray:
    """Directions (k, 3) in the link of the joint `ground` along which the ends of a loop meet."""
    if len(passive) == 3:
        return np.eye(3)
    directions = {i: _direction(joints, i, ground) for i in around}
    turning = [i for i in around if joints[i].kind == "revolute"]
    axis = directions[turning[0]]
    for i in around:
        along = abs(float(directions[i] @ axis))
        apart = along if joints[i].kind == "prismatic" else np.sqrt(max(0.0, 1 - along**2))
        if apart > _PARALLEL:
            raise file.error(
                "E-ROBOT-072",
                ("loops", name, "passive"),
                f"a pin closes a plane loop, but the axis of '{joints[i].name}' does not fit that of '{joints[turning[0]].name}'; name "
                "three passive joints for a ball, or correct the URDF.",
            )
    return normals_to(axis)


def _direction(joints: tuple[Joint, ...], joint: int, ground: int) -> np.ndarray:
    """Axis (3,) of a joint in the link of joint `ground`, all joints standing at zero."""
    turn = np.eye(3)
    for i in path_to(joints, joint):
        if i > ground and (ground < 0 or ground in path_to(joints, i)):
            turn = turn @ joints[i].rotation
    return turn @ joints[joint].axis
