"""Parameters of stage 1: stiffness and damping of every spring, and nuisance parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.elasticity.response_model.parameter_names import (
    backlash_name,
    hardening_name,
    held_inertia_name,
    pose_labels,
    slip_share_name,
    slip_twist_name,
    viscous_name,
)
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter, Parameters
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import (
    FRICTION_LOG_STD,
    RobotModel,
    elastic_inertials,
    sensor_parameters,
    springs_and_rotors,
    uncertain_drive_gains,
    unit_of,
)
from flexcal.model.vibration import linearise, transfer_matrix

HALF_GAP_STD = 1e-4
"""Prior 1σ in rad of a drive's half gap about the model's own: wide, since the softening of the drive differs from pose to pose."""

SENSOR_RANGE = 4.0
"""Factor between measured and expected readings of a sensor from which its unit or place is wrong."""

HARDENING_STD = 0.3
"""Prior 1σ of a drive's hardening."""

SLIP_SHARE, SLIP_SHARE_LOG_STD = 0.2, 0.7
"""Prior median, and 1σ of the logarithm, of the stiffness of a drive's slipping spring over that of the drive."""

SLIP_TWIST, SLIP_TWIST_LOG_STD = 2e-4, 0.8
"""Prior median, rad, and 1σ of the logarithm, of the twist at which it slips: with the share, gears' hysteresis of 0.1 to 1 arc minute."""


def stiffness_parameters(
    model: RobotModel,
    responses: Sequence[FrequencyResponse],
    *,
    inertias_known: bool = False,
    backlash: bool = False,
    hardening: bool = False,
    hysteresis: bool = False,
) -> Parameters:
    """All parameters of stage 1 with their priors.

    Springs, rotor inertias, viscous coefficients and masses are estimated as logarithms. The motor's viscous coefficient is free in every
    pose: friction under the reference motion acts like one that differs from pose to pose. One delay an axis has the prior 0 ± the sample
    time, one drive gain that of the torque constants; a sensor on the arm has its sensitivity, delay and errors of mounting. Rotor inertias
    have the prior of robot.yaml; so have mass and centre of mass of every link that an elastic joint moves, and the payload's mass, unless
    `inertias_known`. With `backlash`, a drive with backlash has its half gap: while it stands open, the drive appears softer. With
    `hardening`, every drive may be stiffer where it carries more torque, with `hysteresis` it has a spring that slips. Raises
    `FlexcalError` where responses do not fit the robot.
    """
    check_responses(model, responses)
    loaded = any(r.payload != 0 for r in responses)
    late = max(r.sample_time for r in responses)
    items = [*springs_and_rotors(model)]
    if not inertias_known:
        items += elastic_inertials(model, loaded=loaded)
    items += held_inertias(model)
    for joint in model.driven:
        name = f"{joint.name}.delay"
        items.append(Parameter(name, "s", 0.0, prior_std=late))
    items += uncertain_drive_gains(model, [joint.index for joint in model.driven])
    for name in dict.fromkeys(name for response in responses for name in response.sensors):
        items += sensor_parameters(model.sensors[name], late)
    for response, label in zip(responses, pose_labels(responses), strict=True):
        loss = apparent_viscous(response)
        items += [
            Parameter(
                viscous_name(joint.name, label), "N m s/rad", value, prior_std=FRICTION_LOG_STD, scale="log"
            )
            for joint, value in zip(model.driven, loss, strict=True)
        ]
    if backlash:
        items += [
            Parameter(
                backlash_name(joint.name),
                "rad",
                float(model.drives.backlash[joint.index]),
                lower=0.0,
                prior_std=HALF_GAP_STD,
            )
            for joint in model.driven
            if joint.index in model.backlash_joints
        ]
    if hardening:
        items += [
            Parameter(
                name := hardening_name(joint.name),
                unit_of(name),
                float(model.springs.hardening[joint.index]),
                lower=0.0,
                prior_std=HARDENING_STD,
            )
            for joint in model.driven
        ]
    for e in model.elastic if hysteresis else ():
        share, twist = slip_share_name(e.name), slip_twist_name(e.name)
        items += [
            Parameter(share, "1", SLIP_SHARE, prior_std=SLIP_SHARE_LOG_STD, scale="log"),
            Parameter(twist, "rad", SLIP_TWIST, prior_std=SLIP_TWIST_LOG_STD, scale="log"),
        ]
    return Parameters(items)


def held_inertias(model: RobotModel) -> list[Parameter]:
    """Inertia, kg m², that moves with the arm of every braked joint in addition to its links: none, or the rotor's if the position loop
    holds the motor in place of a brake. Joints without a declared rotor inertia have none.
    """
    items = []
    for joint in model.elastic:
        rotor = float(model.drives.rotor_inertia[joint.index])
        if joint.index in model.springs.braked and rotor > 0:
            items.append(Parameter(held_inertia_name(joint.name), "kg m²", 0.0, lower=0.0, prior_std=rotor))
    return items


def apparent_viscous(response: FrequencyResponse) -> np.ndarray:
    """Motor damping (axes,) N m s/rad at the lowest tenth of the lines: the real part of the impedance jω Ĝ⁻¹."""
    low = slice(0, max(3, len(response.frequencies_hz) // 10))
    identity = np.broadcast_to(np.eye(response.response.shape[-1]), response.response[low].shape)
    impedance = 1j * response.omega[low, None, None] * np.linalg.solve(response.response[low], identity)
    diagonal = np.diagonal(impedance, axis1=1, axis2=2)
    return np.maximum(np.median(diagonal.real, axis=0), 0.05 * np.median(np.abs(diagonal), axis=0))


def check_responses(model: RobotModel, responses: Sequence[FrequencyResponse]) -> None:
    """Raise `FlexcalError` if there is nothing to fit or a response is of other joints than the elastic ones."""
    elastic = [joint.name for joint in model.elastic]
    if not elastic:
        raise FlexcalError(
            "E-STIFF-002",
            f"{model.path} declares no elastic joint; add `elastic:` with starting values of the stiffnesses.",
        )
    if not responses:
        raise FlexcalError(
            "E-STIFF-003", "There is no frequency response to identify from; give at least one pose."
        )
    for response in responses:
        if list(response.joints) != [name for name in elastic if name in response.joints]:
            raise FlexcalError(
                "E-STIFF-004",
                f"The frequency response of pose {response.pose} is of {', '.join(response.joints)}, but the elastic joints of "
                f"{model.path} are {', '.join(elastic)}; excite these, or some of them with the motors of the others "
                "braked, in this order.",
            )
        if response.joints != responses[0].joints:
            raise FlexcalError(
                "E-STIFF-005",
                f"The frequency response of pose {response.pose} is of {', '.join(response.joints)}, that of pose {responses[0].pose} of "
                f"{', '.join(responses[0].joints)}; excite the same joints in all poses.",
            )
        unknown = [name for name in response.sensors if name not in model.sensors]
        if unknown:
            raise FlexcalError(
                "E-STIFF-006",
                f"The frequency response of pose {response.pose} has the sensor {unknown[0]}, which {model.path} does not declare; add it "
                "under `sensors:` with its frame, xyz and direction.",
            )
        if response.q_mean.shape != (model.n,):
            raise FlexcalError(
                "E-STIFF-007",
                f"The frequency response of pose {response.pose} has a mean position of {response.q_mean.size} joints, "
                f"but the robot has {model.n}.",
            )
        if not (np.isfinite(response.stacked).all() and np.isfinite(response.stacked_covariance).all()):
            raise FlexcalError(
                "E-STIFF-008",
                f"The frequency response of pose {response.pose} holds a NaN or an infinite number.",
            )


def check_sensors(model: RobotModel, responses: Sequence[FrequencyResponse]) -> None:
    """Raise `FlexcalError` if the size or sign of an arm-side sensor's readings contradicts robot.yaml.

    That is told from the lowest third of the lines, where the springs matter least, by the median line: modes that are elsewhere than in
    robot.yaml are no reason.
    """
    for name in dict.fromkeys(name for response in responses for name in response.sensors):
        gains = [_line_gains(model, name, response) for response in responses if name in response.sensors]
        ratios = np.concatenate(gains)
        ratios = ratios[np.abs(ratios) > 0]
        if not ratios.size:
            raise FlexcalError(
                "E-STIFF-009",
                f"the readings of the sensor {name} do not change with the torques; check its cable and its column, or leave that out.",
            )
        _check_gain(
            model, name, float(np.median(np.abs(ratios))), float(np.median(np.real(ratios) / np.abs(ratios)))
        )


def _line_gains(model: RobotModel, name: str, response: FrequencyResponse) -> np.ndarray:
    """Complex ratio (lines,) of measured to expected readings at the lowest third of the lines of a pose."""
    low = slice(0, max(3, len(response.frequencies_hz) // 3))
    system = linearise(model, response.q_mean, response.payload, sensors=[model.sensors[name]])
    expected = transfer_matrix(system, response.frequencies_hz[low]).response[:, -1]
    measured = response.stacked[low, len(response.joints) + response.sensors.index(name)]
    return np.sum(expected.conj() * measured, axis=1) / np.sum(np.abs(expected) ** 2, axis=1)


def _check_gain(model: RobotModel, name: str, size: float, cosine: float) -> None:
    where = f"the readings of the sensor {name}"
    if not 1 / SENSOR_RANGE < size < SENSOR_RANGE:
        ratio = f"{1 / size:.2g} times smaller" if size < 1 else f"{size:.2g} times larger"
        unit = " (they seem to be in g)" if 6 < 1 / size < 16 and model.sensors[name].order == 2 else ""
        raise FlexcalError(
            "E-STIFF-010",
            f"{where} are {ratio} than those of the robot of {model.path}{unit}; give them in m/s², m/s or m, name their unit under "
            f"`signals:`, or correct its quantity, frame, xyz or direction under `sensors:`.",
        )
    if cosine < -0.5:
        raise FlexcalError(
            "E-STIFF-011",
            f"{where} are in the opposite direction to those of the robot of {model.path}; correct its direction or its frame under "
            "`sensors:`.",
        )
