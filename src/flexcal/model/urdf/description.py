"""Conversion of a URDF to joints, inertias and frames, through Pinocchio."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from flexcal.errors import InputError
from flexcal.files.transaction import current_path
from flexcal.model.parts import Inertia, Joint, normals_to
from flexcal.model.urdf.checks import carried_links, mimicry
from flexcal.model.urdf.elements import read_elements


@dataclass(frozen=True, eq=False)
class Frame:
    """A URDF link or joint frame at `rotation` (3, 3), `translation` (3,) in the link of joint `joint` (-1: the base)."""

    joint: int
    rotation: np.ndarray
    translation: np.ndarray


@dataclass(frozen=True, eq=False)
class Description:
    """Content of a URDF: movable joints, the inertia of each (with fixed and locked children), and all frames.

    Joints stand depth first, branches in the order of the file; Pinocchio sorts them by name. `mimics`: for each joint that mimics
    another, its name, the multiplier and the offset.
    """

    name: str
    joints: tuple[Joint, ...]
    inertias: tuple[Inertia, ...]
    frames: dict[str, Frame]
    mimics: dict[str, tuple[str, float, float]]


def read_urdf(path: Path, locked: Mapping[str, float]) -> Description:
    """Read a URDF of revolute, continuous, prismatic and fixed joints; those `locked` at a position (rad or m) count as fixed.

    Raises `InputError`, with line and link or joint, where the file is missing, incomplete or unreadable, where it has no movable joint,
    for other joint types, and where a joint cannot be locked.
    """
    import pinocchio as pin

    if not current_path(path).is_file():
        raise InputError("E-URDF-021", f"{path}: there is no such URDF file; correct `robot:` in robot.yaml.")
    robot = read_elements(path)
    links = carried_links(robot, locked)
    with _silenced() as said:
        try:
            model = pin.buildModelFromXML(robot.text())
        except (ValueError, RuntimeError) as problem:
            raise InputError(
                "E-URDF-022", f"{path}: not a valid URDF ({_first_complaint(said)}); correct it."
            ) from problem
    _check_locked(path, model, locked)
    try:
        model = pin.buildReducedModel(model, *locked_joints(model, locked))
    except ValueError as problem:  # Pinocchio looks frames up by name, and joints and links are both frames
        raise InputError(
            "E-URDF-023", f"{path}: a joint and a link have one name ({problem}); rename one."
        ) from problem
    if model.njoints < 2:
        raise InputError("E-URDF-024", f"{path}: the URDF has no movable joint; a robot needs at least one.")
    order = [model.getJointId(name) for name in links if model.existJointName(name)]
    place = {i: k for k, i in enumerate([0, *order], start=-1)}
    joints = []
    for i in order:
        kind, axis = _kind_and_axis(model.joints[i])
        bounded = model.joints[i].nq == 1
        at, rate = model.joints[i].idx_q, model.joints[i].idx_v
        effort = model.effortLimit if hasattr(model, "effortLimit") else model.upperEffortLimit
        velocity = model.velocityLimit if hasattr(model, "velocityLimit") else model.upperVelocityLimit
        joints.append(
            Joint(
                name=model.names[i],
                link=links[model.names[i]],
                parent=place[model.parents[i]],
                kind=kind,
                rotation=np.array(model.jointPlacements[i].rotation),
                translation=np.array(model.jointPlacements[i].translation),
                axis=axis,
                normals=normals_to(axis),
                lower=float(model.lowerPositionLimit[at]) if bounded else -np.inf,
                upper=float(model.upperPositionLimit[at]) if bounded else np.inf,
                velocity=float(velocity[rate]),
                effort=float(effort[rate]),
            )
        )
    inertias = tuple(
        Inertia(float(y.mass), np.array(y.lever), np.array(y.inertia))
        for y in (model.inertias[i] for i in order)
    )
    frames = {
        f.name: Frame(place[f.parentJoint], np.array(f.placement.rotation), np.array(f.placement.translation))
        for f in model.frames
    }
    return Description(model.name, tuple(joints), inertias, frames, mimicry(robot, locked))


def locked_joints(model: Any, locked: Mapping[str, float]) -> tuple[list[int], np.ndarray]:
    """Arguments of Pinocchio's `buildReducedModel` that lock joints at positions (rad or m): joint numbers and a configuration (nq,)."""
    import pinocchio as pin

    q = pin.neutral(model)
    for name, position in locked.items():
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = (
            position if joint.nq == 1 else (np.cos(position), np.sin(position))
        )
    return [model.getJointId(name) for name in locked], q


def _check_locked(path: Path, model: Any, locked: Mapping[str, float]) -> None:
    for name, position in locked.items():
        if not model.existJointName(name):
            raise InputError(
                "E-URDF-025",
                f"{path}: there is no movable joint '{name}' to lock; there are {', '.join(model.names[1:])}; "
                "correct `locked:` in robot.yaml.",
            )
        joint = model.joints[model.getJointId(name)]
        lower, upper = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        if joint.nq == 1 and not lower <= position <= upper:
            raise InputError(
                "E-URDF-026",
                f"{path}: '{name}' is locked at {position:g}, but its limits are {lower:g} and {upper:g}; "
                "correct `locked:` in robot.yaml.",
            )


def _kind_and_axis(joint) -> tuple[str, np.ndarray]:
    short = joint.shortname().removeprefix("JointModel")
    kind = "prismatic" if short.startswith("P") else "revolute"
    if short[-1] in "XYZ":
        return kind, np.eye(3)["XYZ".index(short[-1])]
    plain = joint.extract() if hasattr(joint, "extract") else joint
    axis = np.array(plain.axis if hasattr(plain, "axis") else _turning(joint), dtype=float)
    return kind, axis / np.linalg.norm(axis)


def _turning(joint) -> np.ndarray:
    """Axis (3,) of a continuous joint, which Pinocchio stores in the motion subspace alone."""
    data, q = joint.createData(), np.zeros(joint.idx_q + joint.nq)
    q[joint.idx_q] = 1.0
    joint.calc(data, q)
    return np.array(data.S).ravel()[3:]


@contextmanager
def _silenced() -> Iterator[BinaryIO]:
    """Redirect the process's standard output and error, to which the C++ parser prints, to a file."""
    sys.stdout.flush()
    sys.stderr.flush()
    saved = [os.dup(1), os.dup(2)]
    try:
        with tempfile.TemporaryFile() as said:
            os.dup2(said.fileno(), 1)
            os.dup2(said.fileno(), 2)
            yield said
    finally:
        os.dup2(saved[0], 1)
        os.dup2(saved[1], 2)
        for descriptor in saved:
            os.close(descriptor)


def _first_complaint(said: BinaryIO) -> str:
    said.seek(0)
    errors = [line for line in said.read().decode(errors="replace").splitlines() if line.startswith("Error:")]
    return " ".join(errors[0].removeprefix("Error:").split()) if errors else "no reason is given"
