"""What commanded and measured positions tell of actuators, and what they leave open."""

from __future__ import annotations

import numpy as np

from flexcal.actuators.servo_parameters import Servo
from flexcal.estimation import LOG_STD_LIMIT, Estimate
from flexcal.export import Actuators, actuator_name
from flexcal.model.robot import RobotModel

_SHARE = 1e-6
"""Coefficient from which a parameter counts as absorbing one that was held."""


def determined(
    model: RobotModel,
    servo: Servo,
    estimate: Estimate,
    found: Actuators,
    links: np.ndarray,
    open_scale: np.ndarray,
) -> tuple[bool, ...]:
    """For every parameter whether the logs tell its value.

    Positions tell torques relative to the known inertia and weight of the links: where these hardly act on a joint, one factor is common
    to its gains, friction and armature (`open_scale` (n,)), or the fit holds one of them, and those that absorb it have no value of their
    own; or all are uncertain. Where the stiffness of a joint is open, so is everything else of it but the delay. Armature and viscous
    friction count as known where their standard deviation is below a quarter of the inertia on the joint, with that of the `links` (n,),
    and of all its damping.
    """
    open_ = {entry.name for entry in estimate.dropped}
    open_ |= {name for entry in estimate.dropped for name, share in entry.absorbed_by if abs(share) > _SHARE}
    std = np.sqrt(np.diag(estimate.covariance))
    number = {name: k for k, name in enumerate(estimate.parameters.names)}
    whole = {"armature": links + found.armature, "viscous": found.damping + found.viscous}
    for i, joint in enumerate(model.joint_names):
        for key in servo.keys:
            name = actuator_name(joint, key)
            if key in whole and std[number[name]] > LOG_STD_LIMIT * whole[key][i]:
                open_.add(name)
        gain = actuator_name(joint, "stiffness")
        if not servo.known and (gain in open_ or std[number[gain]] > LOG_STD_LIMIT or open_scale[i]):
            open_ |= {actuator_name(joint, key) for key in servo.keys if key != "delay"}
    return tuple(
        identified and item.name not in open_
        for identified, item in zip(estimate.identifiable, estimate.parameters, strict=True)
    )
