"""The chain of joints between the base and a target."""

from __future__ import annotations

from flexcal.errors import FlexcalError
from flexcal.model.parts import Point
from flexcal.model.robot import RobotModel


def chain_to(model: RobotModel, point: str | None, format_name: str) -> tuple[str, tuple[int, ...]]:
    """Name of a target (default: the first) and indices of the joints that move it, from the base on.

    Raises `FlexcalError` for an unknown point, and for a robot without any, to which the `format_name` could lead,
    and one with joints that follow others.
    """
    target = _target(model, point, format_name)
    model.require_motors(format_name)
    return target.name, model.path_to(target.joint)


def motors_to(model: RobotModel, point: str | None, format_name: str) -> tuple[str, tuple[int, ...]]:
    """Name of a target (default: the first) and numbers of the motors that move it; raises `FlexcalError` as `chain_to` for points."""
    target = _target(model, point, format_name)
    moving = model.moving(target.joint)
    return target.name, tuple(k for k, joint in enumerate(model.motors) if joint in moving)


def _target(model: RobotModel, point: str | None, format_name: str) -> Point:
    if not model.points:
        raise FlexcalError(
            "E-EXPORT-001",
            f"{format_name} are of the chain from the base to a point, and {model.path} declares none; add one under `points:`.",
        )
    return model.point(point)
