"""Sensitivity of the frequency response in one pose to springs, rotors and links: whitened Jacobian with nuisances eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency.response_noise import (
    COMMON_SENSORS,
    FrictionDisturbance,
    ResponseSensors,
    equation_error,
)
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter, Parameters, Sensitivity
from flexcal.model.robot import (
    DRIVE_GAIN,
    FRICTION_LOG_STD,
    FRICTION_TOLERANCE,
    GEOMETRY,
    RobotModel,
    declared_parameter,
    elastic_inertials,
    mounting_names,
    sensitivity_name,
    sensor_delay_name,
    sensor_parameters,
    springs_and_rotors,
    uncertain_drive_gains,
)
from flexcal.model.vibration import (
    KNOT_OCTAVES,
    friction_response_change,
    linearise,
    sensitivity_response_change,
    transfer_matrix,
)
from flexcal.progress import Progress, silent


@dataclass(frozen=True, eq=False)
class PoseResponse:
    """Response of one pose for the design: E axes on L lines, and S sensors on the arm.

    `response` (L, E + S, E); `derivatives` (L, E + S, E, p) by the parameters that all poses share, `nuisance` (L, E + S, E, k) by the
    pose's own, each in units of its prior; `friction` and `sensors` make the noise, of sensors on the arm by the `orders` (S) of the
    derivative that they measure.
    """

    response: np.ndarray
    derivatives: np.ndarray
    nuisance: np.ndarray
    friction: FrictionDisturbance
    sensors: ResponseSensors
    orders: tuple[int, ...] = ()

    def rows(self, plan: MultisinePlan) -> np.ndarray:
        """Factor R (p, p), upper triangular: RᵀR is the information about the shared parameters with the nuisances eliminated.

        In the triangular factor of [nuisance | shared] over the nuisances' priors [1 | 0], the last block is a root of the Schur
        complement S = A - B D⁻¹ Bᵀ.
        """
        own = self.nuisance.shape[-1]
        whitened = self.whitened(plan)
        stacked = np.vstack([np.eye(own, whitened.shape[1]), whitened])
        return np.asarray(np.linalg.qr(stacked, mode="r"))[own:, own:]

    def whitened(self, plan: MultisinePlan) -> np.ndarray:
        """Rows (2 L (E + S) E, k + p): √2 times real and imaginary part of C⁻¹ ∂G diag(amplitude), nuisances first.

        cov(vec G) = (Γ Γᴴ)⁻¹ ⊗ C Cᴴ with Γ Γᴴ = diag(amplitude²) and C Cᴴ the covariance of `equation_error`.
        """
        change = np.concatenate([self.nuisance, self.derivatives], axis=-1)
        lines, outputs = change.shape[:2]
        root = np.linalg.cholesky(self.error(plan))
        white = np.linalg.solve(root, change.reshape(lines, outputs, -1)).reshape(change.shape)
        white = (white * plan.amplitude.T[:, None, :, None]).reshape(-1, change.shape[-1])
        return np.sqrt(2.0) * np.vstack([np.real(white), np.imag(white)])

    def gains(self, plan: MultisinePlan, gradient: np.ndarray) -> np.ndarray:
        """Derivative (E, L), per N² m² of squared amplitude, of a criterion with the derivative `gradient` (p, p) by the information."""
        own = self.nuisance.shape[-1]
        white = self.whitened(plan)
        inner = np.eye(own) + white[:, :own].T @ white[:, :own]
        left = white[:, own:] - white[:, :own] @ np.linalg.solve(inner, white[:, :own].T @ white[:, own:])
        gain = np.einsum("rp,pq,rq->r", left, gradient, left, optimize=True)
        return gain.reshape(2, *self.response.shape).sum(axis=(0, 2)).T / plan.amplitude**2

    def error(self, plan: MultisinePlan) -> np.ndarray:
        """Covariance (L, E + S, E + S) of `equation_error`."""
        return equation_error(plan, self.response, self.friction, self.sensors, self.orders)

    def relative_error(self, plan: MultisinePlan) -> np.ndarray:
        """Relative standard deviation (L, E) of every motor's own response."""
        own = self.error(plan)[:, : self.response.shape[2], : self.response.shape[2]]
        variance = np.real(np.diagonal(own, axis1=1, axis2=2)) / plan.amplitude.T**2
        return np.sqrt(variance) / np.abs(np.diagonal(self.response, axis1=1, axis2=2))


def response_parameters(model: RobotModel, plan: MultisinePlan) -> Parameters:
    """Parameters common to the responses of all poses: springs, rotors, inertials of links and payload, a delay and gain per axis,
    geometric errors, and of every sensor on the arm its sensitivity, delay and mounting errors.

    Priors are those that robot.yaml declares; `prior_of_parameters` takes what was estimated before instead.
    """
    delays = (
        Parameter(f"{joint.name}.delay", "s", 0.0, prior_std=1 / plan.rate_hz) for joint in model.driven
    )
    inertials = elastic_inertials(model, loaded=plan.payload != 0)
    errors = (declared_parameter(model, f"{name}.{key}") for name in model.joint_names for key in GEOMETRY)
    sensors = (
        item for sensor in model.sensors.values() for item in sensor_parameters(sensor, 1 / plan.rate_hz)
    )
    gains = uncertain_drive_gains(model, [joint.index for joint in model.driven])
    return Parameters((*springs_and_rotors(model), *inertials, *delays, *gains, *errors, *sensors))


def response_sensitivity(
    model: RobotModel,
    poses: np.ndarray,
    plan: MultisinePlan,
    parameters: Parameters,
    sensors: ResponseSensors = COMMON_SENSORS,
    *,
    every: int = 1,
    progress: Progress = silent,
) -> Sensitivity:
    """Rows of every pose of `poses` (candidates, n) under the excitation of `plan`, in the shared `parameters`.

    To compare many poses quickly, one line in `every` is evaluated, as if its neighbours told as much.

    The prior is the robot's posterior, where nothing was estimated that of the parameters.

    Raises `FlexcalError` where the plan does not excite exactly the elastic joints.
    """
    thin = thinned(plan, every)
    rows = []
    for number, q in enumerate(poses):
        progress("sensitivities", number / len(poses))
        friction = friction_disturbance(model, q, plan).thinned(every)
        rows.append(pose_response(model, q, thin, parameters, friction, sensors).rows(thin))
    progress("sensitivities", 1.0)
    return Sensitivity(
        np.array(rows).reshape(len(poses), *2 * (len(parameters),)),
        parameters,
        prior_of_parameters(model, parameters),
    )


def prior_of_parameters(model: RobotModel, parameters: Parameters) -> np.ndarray:
    """Information (p, p) of the robot's posterior, and of the parameters' priors if not estimated."""
    prior = model.posterior.prior(parameters)[1]
    scale = np.sqrt(np.diag(prior))
    information = np.linalg.inv(prior / np.outer(scale, scale)) / np.outer(scale, scale)
    return (information + information.T) / 2


def pose_response(
    model: RobotModel,
    q: np.ndarray,
    plan: MultisinePlan,
    parameters: Parameters,
    friction: FrictionDisturbance,
    sensors: ResponseSensors = COMMON_SENSORS,
) -> PoseResponse:
    """Response, derivatives and noise in the pose `q` (n,); the motors' viscous coefficients are those of robot.yaml plus friction's.

    Its own nuisances: the logarithm of every motor's viscous coefficient, and what its friction deviates from one at any frequency.
    """
    if plan.joints != tuple(joint.index for joint in model.driven):
        raise FlexcalError(
            "E-DESIGN-011",
            f"the plan must excite exactly the elastic joints of {model.path}, in their order.",
        )
    frequencies = plan.frequencies_hz
    rubbing = [f"{joint.name}.viscous" for joint in model.driven]
    viscous = np.nan_to_num(model.drives.viscous[list(plan.joints)]) + friction.viscous
    robot = model.with_values(dict(zip(rubbing, viscous, strict=True)))
    own = [name for name in parameters.names if _in_linearisation(name)]
    arm_sensors = tuple(model.sensors.values())
    system = linearise(robot, q, plan.payload, derivatives=(*own, *rubbing), sensors=arm_sensors)
    moved = transfer_matrix(system, frequencies)
    response, by = moved.response, dict(zip(moved.names, np.moveaxis(moved.derivatives, -1, 0), strict=True))
    known = _geometric(robot, q, plan, parameters, response) | _of_sensors(robot, q, plan, response)
    columns = []
    for item in parameters:
        if item.name in known:
            columns.append(known[item.name])
        elif item.name.endswith(".delay"):
            axis = [joint.name for joint in model.driven].index(item.name.removesuffix(".delay"))
            columns.append(_late(response, frequencies, axis))
        elif item.name.endswith(f".{DRIVE_GAIN}"):
            axis = [joint.name for joint in model.driven].index(item.name.removesuffix(f".{DRIVE_GAIN}"))
            columns.append(response * (np.arange(response.shape[2]) == axis))
        else:
            columns.append(by[item.name] * (item.value if item.scale == "log" else 1.0))
    loss = [by[name] * value * FRICTION_LOG_STD for name, value in zip(rubbing, viscous, strict=True)]
    strange = friction_response_change(response, frequencies, FRICTION_TOLERANCE * viscous, KNOT_OCTAVES)
    uneven = sensitivity_response_change(
        response,
        frequencies,
        arm_sensors,
        every=tuple(sensor.name for sensor in arm_sensors),
        grid=frequencies,
    )
    return PoseResponse(
        response,
        np.stack(columns, axis=-1),
        np.concatenate([np.stack(loss, axis=-1), strange, uneven], axis=-1),
        friction,
        sensors,
        tuple(sensor.order for sensor in arm_sensors),
    )


def friction_disturbance(model: RobotModel, q: np.ndarray, plan: MultisinePlan) -> FrictionDisturbance:
    """Disturbance by friction in the pose `q` (n,) under all lines of `plan`."""
    return FrictionDisturbance.of(model, linearise(model, q, plan.payload), plan)


def thinned(plan: MultisinePlan, step: int) -> MultisinePlan:
    """Plan with every `step`-th line only, the power raised to give a band equal information."""
    kept = plan.amplitude[:, ::step] * np.sqrt(len(plan.lines) / len(plan.lines[::step]))
    return replace(plan, lines=plan.lines[::step], amplitude=kept)


def _in_linearisation(name: str) -> bool:
    return (
        not name.startswith("sensor.")
        and not name.endswith((".delay", f".{DRIVE_GAIN}"))
        and name.rpartition(".")[2] not in GEOMETRY
    )


def _late(response: np.ndarray, frequencies: np.ndarray, axis: int) -> np.ndarray:
    change = np.zeros_like(response)
    change[:, :, axis] = -2j * np.pi * frequencies[:, None] * response[:, :, axis]
    return change


def _geometric(
    robot: RobotModel, q: np.ndarray, plan: MultisinePlan, parameters: Parameters, response: np.ndarray
) -> dict[str, np.ndarray]:
    """∂G (L, E, E) by every geometric error, by forward differences of its tolerance."""
    changes = {}
    for item in parameters:
        if item.name.rpartition(".")[2] in GEOMETRY:
            other = robot.with_values({item.name: item.value + item.prior_std})
            system = linearise(other, q, plan.payload, sensors=tuple(robot.sensors.values()))
            changes[item.name] = (
                transfer_matrix(system, plan.frequencies_hz).response - response
            ) / item.prior_std
    return changes


def _of_sensors(
    robot: RobotModel, q: np.ndarray, plan: MultisinePlan, response: np.ndarray
) -> dict[str, np.ndarray]:
    """∂G (L, E + S, E) by sensitivity, delay and mounting of every sensor on the arm, the last by forward differences."""
    changes: dict[str, np.ndarray] = {}
    sensors, axes = tuple(robot.sensors.values()), response.shape[2]
    for row, sensor in enumerate(sensors, start=axes):
        by_gain, by_delay = np.zeros_like(response), np.zeros_like(response)
        by_gain[:, row] = response[:, row]
        by_delay[:, row] = -2j * np.pi * plan.frequencies_hz[:, None] * response[:, row]
        changes |= {sensitivity_name(sensor.name): by_gain, sensor_delay_name(sensor.name): by_delay}
        for k, (name, std) in enumerate(zip(mounting_names(sensor.name), sensor.mounting_std, strict=True)):
            if std > 0:
                misplaced = sensor.misplaced(std * np.eye(5)[k])
                moved = tuple(misplaced if s is sensor else s for s in sensors)
                system = linearise(robot, q, plan.payload, sensors=moved)
                changes[name] = (transfer_matrix(system, plan.frequencies_hz).response - response) / std
    return changes
