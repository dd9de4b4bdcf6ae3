"""A robot with a point at the origin of a URDF frame, which robot.yaml need not declare."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from flexcal.errors import InputError
from flexcal.model.point import Point
from flexcal.model.robot_model import RobotModel
from flexcal.model.urdf import read_urdf


def with_frame(model: RobotModel, frame: str) -> RobotModel:
    """`model` with a point named as the URDF frame `frame`, at its origin, after the declared ones; itself where robot.yaml declares that.

    Raises `InputError` for a frame that the URDF lacks or that no joint moves, and where a declared point of that name is elsewhere.
    """
    declared = model.points.get(frame)
    if declared is not None:
        if declared.frame == frame and not declared.xyz.any():
            return model
        raise InputError(
            f"{model.path} declares a point '{frame}' that is not at the origin of the frame '{frame}'; rename it there, or give --target."
        )
    frames = read_urdf(model.urdf, model.config.locked).frames
    place = frames.get(frame)
    if place is None or place.joint < 0:
        moving = ", ".join(name for name, known in frames.items() if known.joint >= 0)
        raise InputError(f"no joint of {model.urdf.name} moves a frame '{frame}'; give one of {moving}.")
    point = Point(frame, frame, place.joint, place.rotation, place.translation, np.zeros(3))
    return replace(
        model,
        points=MappingProxyType({**model.points, frame: point}),
        point_error=np.vstack([model.point_error, np.zeros(3)]),
    )
