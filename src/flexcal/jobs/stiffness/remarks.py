"""Remarks on identified springs: added joints, braked motors, misfit, bearing axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.elasticity.identification import SpringFit
from flexcal.estimation import Estimate
from flexcal.jobs.stiffness.bearing_axes import response_bearings_remarks
from flexcal.model.robot import RobotModel, mounting_names, sensitivity_name
from flexcal.report.checks import drive_gain_sentence, misfit_sentences, torque_scale_sentence
from flexcal.report.sections import hardening_sentence, hysteresis_sentence

_ONE_SIDED = 1.645
_ODD = 3.0
"""Deviation of a sensor's sensitivity, in standard deviations, from which a remark is made."""


def further_joints(estimate: Estimate, model: RobotModel) -> tuple[str, ...]:
    """Joints declared rigid in robot.yaml that received a drive spring because the responses require it."""
    declared = {entry.joint for entry in model.config.elastic}
    return tuple(
        name
        for name in model.joint_names
        if name not in declared and f"{name}.drive.stiffness" in estimate.parameters
    )


def stiffness_remarks(result: SpringFit, model: RobotModel) -> tuple[str, ...]:
    """Remarks on identified springs, the most important last."""
    estimate, joints = result.estimate, further_joints(result.estimate, model)
    remarks: list[str] = []
    if joints:
        remarks.append(
            f"robot.yaml declares {_listed(joints)} rigid, but the responses show elasticity: a drive spring was identified for each"
        )
    remarks += [
        f"the stiffness of the drive of {joint} is too high to be determined; it is at least "
        f"{_lower_limit(estimate, f'{joint}.drive.stiffness'):.2g} N m/rad (95 %)"
        for joint in joints
        if estimate.interval(f"{joint}.drive.stiffness") is None
    ]
    moving = [joint for joint in joints if _moves(estimate, joint, model)]
    if moving:
        remarks.append(
            f"the motor of {_listed(moving)} seems to have moved with the arm, held by its controller and not by a brake; the identified "
            "spring then contains the stiffness of the controller; apply the brakes and repeat, or use this spring with care"
        )
    remarks += sensor_remarks(result, model)
    for sentence in (hardening_sentence(estimate), hysteresis_sentence(estimate)):
        if sentence:
            remarks.append(sentence[0].lower() + sentence.rstrip(".")[1:])
    if gains := drive_gain_sentence(estimate):
        remarks.append(gains)
    if estimate.misfit is not None:
        remarks.append(f"unexplained responses: {misfit_sentences(estimate.misfit).rstrip('.')}")
    if result.scale is not None:
        remarks.append(torque_scale_sentence(result.scale.document()))
    return (*remarks, *response_bearings_remarks(result.bearings))


def sensor_remarks(result: SpringFit, model: RobotModel) -> tuple[str, ...]:
    """Remarks on every arm-side sensor."""
    remarks = []
    for name in result.sensors:
        sensitivity = result.quantity(sensitivity_name(name))
        std = "" if sensitivity["std"] is None else f" ± {sensitivity['std']:.2g}"
        remarks.append(
            f"the sensor {name} on the arm reads {sensitivity['estimate']:.4g}{std} times what robot.yaml says of it; with that its "
            f"readings are {100 * result.sensor_difference(name):.2g} % off the model's at the median line, as the motors' accelerations "
            f"are {100 * result.motor_difference:.2g} %"
        )
        stated = model.sensors[name].config.sensitivity_std
        if abs(np.log(float(sensitivity["estimate"] or np.nan))) > _ODD * stated:
            remarks.append(
                f"that is more than {_ODD:g} times its sensitivity_std of {stated:g}: check the sensitivity, xyz and direction of {name}"
            )
        config = model.sensors[name].config
        shift = [float(result.estimate.values.get(key, 0.0)) for key in mounting_names(name)]
        far, turned = np.linalg.norm(shift[:3]), np.linalg.norm(shift[3:])
        if (
            max(np.abs(shift[:3])) > _ODD * config.position_std
            or max(np.abs(shift[3:])) > _ODD * config.direction_std
        ):
            remarks.append(
                f"the sensor {name} seems to be {1000 * far:.2g} mm and {np.degrees(turned):.2g} degrees from where robot.yaml has "
                f"it, more than {_ODD:g} times its position_std or direction_std: measure its xyz and direction again, or check its "
                "frame"
            )
    return tuple(remarks)


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _lower_limit(estimate: Estimate, name: str) -> float:
    """Lower 95 % limit of a stiffness, from the standard deviation of its compliance."""
    number = estimate.parameters.index(name)
    return estimate.values[name] / (1.0 + _ONE_SIDED * float(np.sqrt(estimate.covariance[number, number])))


def _moves(estimate: Estimate, joint: str, model: RobotModel) -> bool:
    """Whether more than half of the rotor's inertia moves with the arm, by more than three standard deviations."""
    name = f"{joint}.held_inertia"
    if name not in estimate.parameters:
        return False
    value, number = estimate.values[name], estimate.parameters.index(name)
    std = float(np.sqrt(estimate.covariance[number, number]))
    return value > 0.5 * float(model.drives.rotor_inertia[model.joint_index(joint)]) and value > 3 * std
