"""URDF to joints, inertias and frames, through Pinocchio."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.errors import InputError
from flexcal.model.inertia import Inertia
from flexcal.model.joint import Joint, normals_to


@dataclass(frozen=True, eq=False)
class Frame:
    """A URDF link or joint frame at `rotation` (3, 3), `translation` (3,) in the link of joint `joint` (-1: the base)."""

    joint: int
    rotation: np.ndarray
    translation: np.ndarray


@dataclass(frozen=True, eq=False)
class Description:
    """What flexcal takes from a URDF: movable joints depth first, the inertia each carries (fixed children merged), all frames."""

    name: str
    joints: tuple[Joint, ...]
    inertias: tuple[Inertia, ...]
    frames: dict[str, Frame]


def read_urdf(path: Path) -> Description:
    """Read a URDF of revolute, continuous, prismatic and fixed joints.

    Raises `InputError` where the file is missing or does not parse, where it has no movable joint, and for other joint types.
    """
    import pinocchio as pin

    if not path.is_file():
        raise InputError(f"{path}: there is no such URDF file; correct `robot:` in robot.yaml.")
    try:
        with _quiet() as _:
            model = pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError) as problem:
        raise InputError(f"{path}: not a valid URDF ({_reason(path)}); correct it.") from problem
    if model.njoints < 2:
        raise InputError(f"{path}: the URDF has no movable joint; a robot needs at least one.")
    links = _child_links(path)
    joints = []
    for i in range(1, model.njoints):
        kind, axis = _kind_and_axis(path, model.joints[i], model.names[i])
        bounded = model.joints[i].nq == 1
        at, rate = model.joints[i].idx_q, model.joints[i].idx_v
        effort = model.effortLimit if hasattr(model, "effortLimit") else model.upperEffortLimit
        velocity = model.velocityLimit if hasattr(model, "velocityLimit") else model.upperVelocityLimit
        joints.append(
            Joint(
                name=model.names[i],
                link=links[model.names[i]],
                parent=model.parents[i] - 1,
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
        Inertia(float(y.mass), np.array(y.lever), np.array(y.inertia)) for y in list(model.inertias)[1:]
    )
    frames = {
        f.name: Frame(f.parentJoint - 1, np.array(f.placement.rotation), np.array(f.placement.translation))
        for f in model.frames
    }
    return Description(model.name, tuple(joints), inertias, frames)


def _kind_and_axis(path: Path, joint, name: str) -> tuple[str, np.ndarray]:
    short = joint.shortname().removeprefix("JointModel")
    for prefix, kind in (("RUB", "revolute"), ("R", "revolute"), ("P", "prismatic")):
        if short.startswith(prefix) and short[len(prefix) :] in ("X", "Y", "Z"):
            return kind, np.eye(3)["XYZ".index(short[len(prefix) :])]
    if short in ("RevoluteUnaligned", "RevoluteUnboundedUnaligned", "PrismaticUnaligned"):
        axis = np.array(joint.extract().axis if hasattr(joint, "extract") else joint.axis, dtype=float)
        return ("prismatic" if short.startswith("P") else "revolute"), axis / np.linalg.norm(axis)
    raise InputError(
        f"{path}: joint '{name}' is of a type flexcal does not handle ({short}); use revolute, continuous, prismatic or fixed."
    )


def _child_links(path: Path) -> dict[str, str]:
    import xml.etree.ElementTree as ET

    result = {}
    for joint in ET.parse(path).getroot().findall("joint"):
        child = joint.find("child")
        if child is not None:
            result[joint.get("name", "")] = child.get("link", "")
    return result


def _reason(path: Path) -> str:
    import xml.etree.ElementTree as ET

    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as problem:
        return str(problem)
    if root.tag != "robot":
        return f"its root element is <{root.tag}>, not <robot>"
    return "a link, joint, parent or child is missing or wrong"


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the C++ parser from printing to the process's standard error and output."""
    sys.stdout.flush()
    sys.stderr.flush()
    saved = [os.dup(1), os.dup(2)]
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
            yield
    finally:
        os.dup2(saved[0], 1)
        os.dup2(saved[1], 2)
        for descriptor in saved:
            os.close(descriptor)
