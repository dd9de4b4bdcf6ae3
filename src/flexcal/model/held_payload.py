"""A robot with a payload in any URDF frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.errors import InputError
from flexcal.model.point import Payload
from flexcal.model.robot_model import RobotModel
from flexcal.model.urdf import read_urdf


def last_frame(model: RobotModel) -> str:
    """The link of the last joint."""
    return model.joints[-1].link


def holding(model: RobotModel, frame: str, mass: float, com: np.ndarray, inertia: np.ndarray) -> RobotModel:
    """`model` with a payload of `mass` (kg) in the URDF frame `frame`, as if robot.yaml declared it.

    `com` (3,) m and `inertia` (3, 3) kg m² about it are in that frame. Raises `InputError` for a frame that the URDF lacks or that no
    joint moves.
    """
    frames = read_urdf(model.urdf, model.config.locked).frames
    place = frames.get(frame)
    if place is None or place.joint < 0:
        moving = ", ".join(name for name, known in frames.items() if known.joint >= 0)
        raise InputError(f"no joint of {model.urdf.name} moves a frame '{frame}'; name one of {moving}.")
    held = Payload(frame, place.joint, place.rotation, place.translation, mass, 0.0, com, inertia)
    return replace(
        model,
        nominal_payload=held,
        payload_mass=np.array([mass]),
        payload_com=np.array(com),
        payload_inertia=held.moments,
    )
