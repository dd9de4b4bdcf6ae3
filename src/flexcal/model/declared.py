"""What is known of a robot before anything is identified: one definition for all identifications."""

from __future__ import annotations

from collections.abc import Collection

from flexcal.estimation import Parameter
from flexcal.model.names import GEOMETRY, unit_of
from flexcal.model.robot_model import RobotModel

UNIDENTIFIED_STIFFNESS = 0.3
"""Relative 1σ of a stiffness that nothing but robot.yaml supports."""
LENGTH_TOLERANCE = 3e-4
"""1σ of an uncalibrated length, m."""
ANGLE_TOLERANCE = 5e-4
"""1σ of an uncalibrated offset or misalignment, rad."""

_POSITIVE = ("mass", "rotor_inertia", "stiffness")


def uncertain_inertials(model: RobotModel, links: Collection[int]) -> list[str]:
    """Names of mass and centre of mass of those of the `links` that have a mass, as far as robot.yaml's `prior:` lets them be off."""
    keys = ["mass"] if model.prior.mass > 0 else []
    keys += ["com_x", "com_y", "com_z"] if model.prior.com > 0 else []
    return [f"{model.joints[i].link}.{key}" for i in sorted(links) if model.mass[i] > 0 for key in keys]


def declared(model: RobotModel, name: str) -> Parameter:
    """A parameter at the model's value, with what robot.yaml and workshop tolerances say of it as its prior.

    Mass, rotor inertia and stiffness are estimated as logarithms. A link's inertia about its centre of mass goes with its mass and has no
    prior of its own; friction and torque offset have none at all.
    """
    value, key = model.value(name), name.rpartition(".")[2]
    std = _std(model, name, key)
    scale = "log" if key in _POSITIVE else "linear"
    return Parameter(name, unit_of(name), value, prior_std=std, scale=scale)


def _std(model: RobotModel, name: str, key: str) -> float:
    if name == "payload.mass":
        held = model.nominal_payload
        assert held is not None
        return held.mass_std / held.mass
    if key in GEOMETRY:
        return LENGTH_TOLERANCE if key.startswith("length") else ANGLE_TOLERANCE
    return {
        "mass": model.prior.mass,
        "com_x": model.prior.com,
        "com_y": model.prior.com,
        "com_z": model.prior.com,
        "rotor_inertia": model.prior.rotor_inertia,
        "stiffness": UNIDENTIFIED_STIFFNESS,
    }.get(key, float("inf"))
