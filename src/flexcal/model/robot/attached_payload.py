"""Robot with a payload or a measured point in any URDF frame, and the inertias of its links with the payload."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError, InputError
from flexcal.model.parts import Inertia, Payload, Point, parallel_axis
from flexcal.model.urdf import Frame, read_urdf

if TYPE_CHECKING:
    from flexcal.model.robot.robot_model import RobotModel


def last_frame(model: RobotModel) -> str:
    """Name of the last joint's link."""
    return model.joints[-1].link


def with_payload(
    model: RobotModel, frame: str, mass: float, com: np.ndarray, inertia: np.ndarray
) -> RobotModel:
    """Robot with a payload of `mass` (kg) in the URDF frame `frame`, as if robot.yaml declared it.

    `com` (3,) m and `inertia` (3, 3) kg m² about it are in that frame. Raises `InputError` for a frame that the URDF lacks or that no
    joint moves.
    """
    place = _moving_frame(model, frame)
    payload = Payload(frame, place.joint, place.rotation, place.translation, mass, mass, 0.0, com, inertia)
    return replace(model, payload=payload)


def carried_inertias(model: RobotModel, payload: float | None = None) -> tuple[Inertia, ...]:
    """Inertia of every joint's link, the payload (kg; default: declared mass) included in the link that carries it."""
    declared = model.payload
    if declared is None:
        if payload:
            raise FlexcalError(
                "E-ROBOT-001",
                f"a payload of {payload:g} kg is given but {model.path} declares none; add `payload:`.",
            )
        return model.inertias
    mass = declared.mass if payload is None else payload
    if mass == 0:
        return model.inertias
    link, own = model.inertias[declared.joint], declared.carried(mass)
    total = link.mass + mass
    com = (link.mass * link.com + mass * own.com) / total
    inertia = link.inertia + own.inertia
    inertia = inertia + parallel_axis(link.mass, link.com - com) + parallel_axis(mass, own.com - com)
    return tuple(
        Inertia(total, com, inertia) if i == declared.joint else y for i, y in enumerate(model.inertias)
    )


def with_point_at_frame(model: RobotModel, frame: str) -> RobotModel:
    """Robot with a further point at the origin of the URDF frame `frame`, named as the frame; unchanged if robot.yaml declares that point.

    Raises `InputError` for a frame that the URDF lacks or that no joint moves, and where a declared point of that name is elsewhere.
    """
    declared = model.points.get(frame)
    if declared is not None:
        if declared.frame == frame and not declared.xyz.any():
            return model
        raise InputError(
            "E-ROBOT-002",
            f"{model.path} declares a point '{frame}' that is not at the origin of the frame '{frame}'; rename it there, or give --target.",
        )
    return with_point(model, frame, frame, np.zeros(3))


def with_point(model: RobotModel, name: str, frame: str, xyz: np.ndarray) -> RobotModel:
    """Robot with the point `name` at `xyz` (3,) m in the URDF frame `frame`, in place of a declared one of that name if there is one.

    Raises `InputError` for a frame that the URDF lacks or that no joint moves.
    """
    place = _moving_frame(model, frame)
    point = Point(name, frame, place.joint, place.rotation, place.translation, xyz)
    others = list(model.points)
    geometry = model.geometry
    errors, turns, zeros = (
        dict(zip(others, array, strict=True)) | {name: np.zeros(3)}
        for array in (geometry.point_error, geometry.point_turn, geometry.point_zero)
    )
    return replace(
        model,
        points=MappingProxyType(dict(model.points) | {name: point}),
        geometry=replace(
            geometry,
            point_error=np.array(list(errors.values())),
            point_turn=np.array(list(turns.values())),
            point_zero=np.array(list(zeros.values())),
        ),
    )


def _moving_frame(model: RobotModel, name: str) -> Frame:
    frames = read_urdf(model.urdf, model.config.locked).frames
    place = frames.get(name)
    if place is None or place.joint < 0:
        moving = ", ".join(other for other, known in frames.items() if known.joint >= 0)
        raise InputError(
            "E-ROBOT-003", f"no joint of {model.urdf.name} moves a frame '{name}'; name one of {moving}."
        )
    return place
