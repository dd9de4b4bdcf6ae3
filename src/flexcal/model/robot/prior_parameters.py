"""Prior knowledge about a robot, common to all identifications."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot.arm_sensor import ArmSensor, mounting_names, sensitivity_name, sensor_delay_name
from flexcal.model.robot.parameter_names import DRIVE_GAIN, GEOMETRY, spring_names, unit_in, unit_of
from flexcal.model.robot.robot_model import RobotModel

LENGTH_TOLERANCE = 3e-4
"""1σ of an uncalibrated length, m."""
ANGLE_TOLERANCE = 5e-4
"""1σ of an uncalibrated offset or misalignment, rad."""
GAP_TOLERANCE = 1e-4
"""1σ of an uncalibrated backlash, half the gap, rad."""

SPRING_LOG_STD = 1.5
"""Prior 1σ of the logarithm of every stiffness and damping identified from frequency responses (a factor of 4.5): wide, only keeps the
posterior proper.
"""
FURTHER_SPRING_LOG_STD = 2.0
"""Prior 1σ of the logarithm of the stiffness of a spring added without declaration, about a mode at the highest line."""
SOFTEST_FURTHER_SPRING = 16.0
"""Lowest relative stiffness of such a spring, with its mode at a quarter of the highest line. Softer ones would be visible, and imitate
friction.
"""
FRICTION_LOG_STD = 1.5
"""Prior 1σ of the logarithm of a motor's viscous coefficient in one pose, about the measured or predicted value."""
FRICTION_TOLERANCE = 0.05
"""Relative 1σ of the deviation of a motor's friction impedance from a viscous coefficient, at any frequency."""
SHARED_DISTORTION = 0.2
"""Share of the nonlinear distortion of a frequency response that is common to all realisations, because reference motion and friction
are the same in all; averaging over realisations does not lower it.
"""

_POSITIVE = ("mass", "rotor_inertia", "stiffness", DRIVE_GAIN)


def uncertain_inertials(model: RobotModel, links: Collection[int]) -> list[str]:
    """Names of masses and centres of mass of those `links` with mass that have a nonzero standard deviation in robot.yaml's `prior:`."""
    keys = ["mass"] if model.prior.mass > 0 else []
    keys += ["com_x", "com_y", "com_z"] if model.prior.com > 0 else []
    return [f"{model.joints[i].link}.{key}" for i in sorted(links) if model.links.mass[i] > 0 for key in keys]


def uncertain_tensor_entries(model: RobotModel) -> Iterator[tuple[int, str, float]]:
    """Link, entry and 1σ (kg m²) of the uncertain inertia tensors about centres of mass: moments and products to the share of the moments
    in robot.yaml's `prior:`."""
    share = model.prior.inertia
    for i, tensor in enumerate(model.links.inertia):
        moments = np.diag(tensor)
        if share > 0 and model.links.mass[i] > 0 and np.all(moments > 0):
            for entry in LINK_PARAMETERS[4:]:
                a, b = ("xyz".index(axis) for axis in entry[1:])
                yield i, entry, share * float(np.sqrt(moments[a] * moments[b]))


def uncertain_payload(model: RobotModel) -> tuple[str, ...]:
    """Uncertain payload parameters: the mass with robot.yaml's `mass_std`, or the identified mass and centre of mass."""
    payload = model.payload
    if payload is None:
        return ()
    names = ("payload.mass", "payload.com_x", "payload.com_y", "payload.com_z")
    identified = tuple(name for name in names if model.posterior.determines(name))
    return identified or (("payload.mass",) if payload.mass_std > 0 else ())


def sensor_parameters(sensor: ArmSensor, sample_time: float) -> tuple[Parameter, ...]:
    """Parameters of an arm-side sensor: sensitivity about the stated one, delay of 0 ± the sample time (s), and mounting errors."""
    mounting = zip(mounting_names(sensor.name), sensor.mounting_std, strict=True)
    return (
        Parameter(
            sensitivity_name(sensor.name), "1", 1.0, prior_std=sensor.config.sensitivity_std, scale="log"
        ),
        Parameter(sensor_delay_name(sensor.name), "s", 0.0, prior_std=sample_time),
        *(Parameter(name, unit_of(name), 0.0, prior_std=std) for name, std in mounting if std > 0),
    )


def springs_and_rotors(model: RobotModel) -> tuple[Parameter, ...]:
    """Stiffness and damping of every spring, with wide priors where the robot has no prior of one by name, and the rotor inertias of the
    driven joints with robot.yaml's prior.

    Raises `FlexcalError` for one without a positive value.
    """
    names = spring_names(model)
    rotors = [f"{joint.name}.rotor_inertia" for joint in model.driven]
    for name in (*names, *rotors):
        if not model.value(name) > 0:
            raise FlexcalError(
                "E-ROBOT-037", f"{model.path} gives no positive value of {name} to start from; add one."
            )
    declared_joints = {entry.joint for entry in model.config.elastic}

    def spring(name: str) -> Parameter:
        value, known = model.value(name), name.split(".")[0] in declared_joints
        softest = -np.inf if known or name.endswith(".damping") else value / SOFTEST_FURTHER_SPRING
        width = model.prior.parameters.get(name, SPRING_LOG_STD if known else FURTHER_SPRING_LOG_STD)
        return Parameter(name, unit_of(name), value, lower=softest, prior_std=width, scale="log")

    return (*map(spring, names), *(declared_parameter(model, name) for name in rotors))


def uncertain_drive_gains(model: RobotModel, joints: Collection[int]) -> list[Parameter]:
    """True over logged torques of `joints`, by robot.yaml's prior of the torque constants; none where these are known."""
    if model.prior.torque_constant == 0:
        return []
    return [declared_parameter(model, f"{model.joints[i].name}.{DRIVE_GAIN}") for i in joints]


def elastic_inertials(model: RobotModel, *, loaded: bool) -> list[Parameter]:
    """Uncertain inertials, by robot.yaml's prior, of the links moved by an elastic joint and, if `loaded`, the payload's mass."""
    elastic = {joint.index for joint in model.elastic}
    moved = [i for i in range(len(model.joints)) if not elastic.isdisjoint(model.moving(i))]
    items = [declared_parameter(model, name) for name in uncertain_inertials(model, moved)]
    payload = model.payload
    if loaded and payload is not None and payload.mass > 0 and uncertain_payload(model):
        items.append(declared_parameter(model, "payload.mass"))
    return items


def declared_parameter(model: RobotModel, name: str) -> Parameter:
    """Parameter at the model's value, with its prior from robot.yaml and workshop tolerances.

    Mass, rotor inertia, stiffness and drive gain are estimated as logarithms. A link's inertia about its centre of mass goes with its mass
    and has no prior of its own; friction and torque offset have none at all.
    """
    value, key = model.value(name), name.rpartition(".")[2]
    std = _std(model, name, key)
    scale = "log" if key in _POSITIVE else "linear"
    lower = 0.0 if key == "hardening" else -np.inf
    return Parameter(name, unit_in(model, name), value, lower=lower, prior_std=std, scale=scale)


def _std(model: RobotModel, name: str, key: str) -> float:
    if key == "stiffness" and name in model.prior.parameters:
        return model.prior.parameters[name]
    if name == "payload.mass":
        payload = model.payload
        assert payload is not None
        return payload.mass_std / payload.nominal_mass if payload.mass_std > 0 else float("inf")
    if key in GEOMETRY:
        return LENGTH_TOLERANCE if key.startswith("length") else ANGLE_TOLERANCE
    return {
        "mass": model.prior.mass,
        "com_x": model.prior.com,
        "com_y": model.prior.com,
        "com_z": model.prior.com,
        "rotor_inertia": model.prior.rotor_inertia,
        "stiffness": model.prior.stiffness,
        "backlash": GAP_TOLERANCE,
        DRIVE_GAIN: model.prior.torque_constant,
    }.get(key, float("inf"))
