"""Names of the parameters of stage 1: those of FORMATS, and those that belong to one pose."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel
from flexcal.model.names import SPRINGS


def spring_names(model: RobotModel) -> tuple[str, ...]:
    """Names of the stiffness, then of the damping of every spring, joint by joint: drive, bearing_x, bearing_y."""
    springs = [
        f"{joint.name}.{SPRINGS[c]}"
        for joint in model.elastic
        for c in ((2, 0, 1) if joint.bearings else (2,))
    ]
    return tuple(f"{spring}.{kind}" for kind in ("stiffness", "damping") for spring in springs)


def pose_labels(responses: Sequence[FrequencyResponse]) -> tuple[str, ...]:
    """A label for every response: its pose number in the plan, or its place where numbers repeat."""
    numbers = [response.pose for response in responses]
    if len(set(numbers)) < len(numbers):
        numbers = range(len(responses))
    return tuple(f"pose_{number + 1}" for number in numbers)


def viscous_name(joint: str, pose: str) -> str:
    """Name of a motor's viscous coefficient in one pose."""
    return f"{joint}.viscous.{pose}"


def half_gap_name(joint: str) -> str:
    """Name of the half gap of a drive as its frequency response shows it."""
    return f"{joint}.drive.half_gap"
