"""What stage 1 estimates: stiffness and damping of every spring, and the nuisances that would otherwise be mistaken for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.elasticity.naming import half_gap_name, pose_labels, spring_names, viscous_name
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter, Parameters
from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel
from flexcal.model.declared import declared, uncertain_inertials
from flexcal.model.names import unit_of

SPRING_LOG_STD = 1.5
"""Prior of every stiffness and damping, 1σ of the logarithm about robot.yaml (a factor of 4.5): it only keeps the posterior proper."""

FRICTION_LOG_STD = 1.5
"""Prior of the motor's viscous coefficient in one pose, 1σ of the logarithm about what the lowest lines show."""

HALF_GAP_STD = 1e-4
"""Prior of a drive's half gap, 1σ in rad about the model's own: wide, for the softening of the drive differs from pose to pose."""


def stage_one_parameters(
    model: RobotModel,
    responses: Sequence[FrequencyResponse],
    *,
    inertias_known: bool = False,
    gaps: bool = False,
) -> Parameters:
    """Every parameter of stage 1 with its prior.

    Springs, rotor inertias, viscous coefficients and masses are estimated as logarithms. The motor's viscous coefficient is free
    in every pose: friction under the reference motion acts like one that differs from pose to pose. One delay an axis has the
    prior 0 ± the sample time. Rotor inertias have the prior of robot.yaml; so have mass and centre of mass of every link that an
    elastic joint moves, and the payload's mass, unless `inertias_known`. With `gaps`, a drive
    with backlash has its half gap: while it stands open, the drive appears softer. Raises `FlexcalError` where responses do not fit
    the robot.
    """
    check_responses(model, responses)
    items = [
        Parameter(name, unit_of(name), _positive(model, name), prior_std=SPRING_LOG_STD, scale="log")
        for name in spring_names(model)
    ]
    for joint in model.elastic:
        name = f"{joint.name}.rotor_inertia"
        _positive(model, name)
        items.append(declared(model, name))
    if not inertias_known:
        items += _inertial(model, responses)
    for joint in model.elastic:
        name = f"{joint.name}.delay"
        items.append(Parameter(name, "s", 0.0, prior_std=max(r.sample_time for r in responses)))
    for response, label in zip(responses, pose_labels(responses), strict=True):
        loss = apparent_viscous(response)
        items += [
            Parameter(
                viscous_name(joint.name, label), "N m s/rad", value, prior_std=FRICTION_LOG_STD, scale="log"
            )
            for joint, value in zip(model.elastic, loss, strict=True)
        ]
    if gaps:
        items += [
            Parameter(
                half_gap_name(joint.name),
                "rad",
                float(model.backlash[joint.index]),
                lower=0.0,
                prior_std=HALF_GAP_STD,
            )
            for joint in model.elastic
            if joint.index in model.backlash_joints
        ]
    return Parameters(items)


def apparent_viscous(response: FrequencyResponse) -> np.ndarray:
    """Motor loss (axes,) N m s/rad seen at the lowest tenth of the lines: the real part of the impedance jω Ĝ⁻¹."""
    low = slice(0, max(3, len(response.frequencies_hz) // 10))
    identity = np.broadcast_to(np.eye(response.response.shape[-1]), response.response[low].shape)
    impedance = 1j * response.omega[low, None, None] * np.linalg.solve(response.response[low], identity)
    diagonal = np.diagonal(impedance, axis1=1, axis2=2)
    return np.maximum(np.median(diagonal.real, axis=0), 0.05 * np.median(np.abs(diagonal), axis=0))


def check_responses(model: RobotModel, responses: Sequence[FrequencyResponse]) -> None:
    """Raises `FlexcalError` where there is nothing to fit or a response is of other joints than the elastic ones."""
    elastic = tuple(joint.name for joint in model.elastic)
    if not elastic:
        raise FlexcalError(
            f"{model.path} declares no elastic joint; add `elastic:` with starting values of the stiffnesses."
        )
    if not responses:
        raise FlexcalError("There is no frequency response to identify from; give at least one pose.")
    for response in responses:
        if tuple(response.joints) != elastic:
            raise FlexcalError(
                f"The frequency response of pose {response.pose} is of {', '.join(response.joints)}, but the elastic joints of "
                f"{model.path} are {', '.join(elastic)}; excite exactly these, in this order."
            )
        if response.q_mean.shape != (model.n,):
            raise FlexcalError(
                f"The frequency response of pose {response.pose} has a mean position of {response.q_mean.size} joints, "
                f"but the robot has {model.n}."
            )
        if not (np.isfinite(response.response).all() and np.isfinite(response.covariance).all()):
            raise FlexcalError(
                f"The frequency response of pose {response.pose} holds a NaN or an infinite number."
            )


def _inertial(model: RobotModel, responses: Sequence[FrequencyResponse]) -> list[Parameter]:
    elastic = {joint.index for joint in model.elastic}
    moved = []
    for i in range(model.n):
        at = i
        while at >= 0 and at not in elastic:
            at = model.joints[at].parent
        moved += [i] if at >= 0 else []
    items = [declared(model, name) for name in uncertain_inertials(model, moved)]
    held = model.payload
    if held is not None and held.mass > 0 and held.mass_std > 0 and any(r.payload != 0 for r in responses):
        items.append(declared(model, "payload.mass"))
    return items


def _positive(model: RobotModel, name: str) -> float:
    value = model.value(name)
    if not value > 0:
        raise FlexcalError(f"{model.path} gives no positive value of {name} to start from; add one.")
    return value
