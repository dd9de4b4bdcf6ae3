"""Torques of exciting trajectories as a least-squares problem, linearised about an elastic robot (Eq. 2.26)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.inverse_model import CLASSIC
from flexcal.dynamics.signals import Motion, PeriodicMotion, real_rows
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter, Parameters
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import (
    DRIVE_GAIN,
    GEOMETRY,
    PARALLEL,
    SPRINGS,
    RobotModel,
    declared_parameter,
    uncertain_drive_gains,
    uncertain_inertials,
    uncertain_tensor_entries,
)
from flexcal.model.torques import torque_regressor
from flexcal.model.vibration import ElasticArm, periodic_torque

SAMPLES_PER_LINE = 4
_STEP = 1e-3
"""Step of the central differences, in estimation coordinates: torques are polynomials of these, nearly linear over the step."""
_REVERSAL_VELOCITY = 0.02
"""Velocity, rad/s, below which friction may differ from Coulomb's."""
_FIRST_SIGMA = 0.01
"""Initial noise, relative to the torques of the joint."""


def unknowns(model: RobotModel) -> tuple[Parameters, tuple[str, ...]]:
    """All unknowns of the torques with their prior, and the names of those that belong to the robot's dynamics.

    These are mass and centre of mass of every link, the classic terms of the drives, and the drive gains; the others are spring
    stiffnesses, geometric errors, what friction does at a reversal, and the inertia tensors about the centres of mass, in units of their
    prior. Raises `FlexcalError` where a rotor inertia is missing.
    """
    lacking = [
        name
        for name, value in zip(model.joint_names, model.drives.rotor_inertia, strict=True)
        if not value > 0
    ]
    if lacking:
        raise FlexcalError(
            "E-DYN-017",
            f"{model.path} gives {lacking[0]} no rotor inertia, which the prior needs; add `drives: {{rotor_inertia: […]}}`.",
        )
    own = [*uncertain_inertials(model, range(model.n)), *_drive_names(model)]
    beside = [f"{e.name}.{SPRINGS[c]}.stiffness" for e in model.elastic for c in sorted(e.components)]
    beside += [f"{joint}.{key}" for joint in model.joint_names for key in GEOMETRY]
    start = model.with_values({name: 0.0 for name in own if np.isnan(model.value(name))})
    gains = uncertain_drive_gains(model, range(model.n))
    items = [*(declared_parameter(start, name) for name in (*own, *beside)), *gains]
    own += [item.name for item in gains]
    shapes = [_tensor(model, i, entry) for i, entry, _ in uncertain_tensor_entries(model)]
    items += [
        Parameter(name, "1", 0.0, prior_std=1.0) for name in (*map(_reversal, model.joint_names), *shapes)
    ]
    return Parameters(items), tuple(own)


@dataclass(frozen=True, eq=False)
class LinearisedEquations:
    """T trajectories, n joints, 2 K + 1 coefficients: `measured` minus predicted torque is `residual` (T, 2 K + 1, n), N m.

    `jacobian` (T, 2 K + 1, n, p) is the derivative of the prediction in estimation coordinates, at the values of `parameters`.
    """

    parameters: Parameters
    measured: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray

    @classmethod
    def about(
        cls,
        model: RobotModel,
        parameters: Parameters,
        motions: Sequence[PeriodicMotion],
        payload: float | None,
    ) -> LinearisedEquations:
        """Equations linearised at the values of the parameters."""
        x = parameters.coordinates()
        measured, predicted, jacobians = [], [], []
        for motion in motions:
            measured.append(real_rows(motion.torque))
            torque, jacobian = _links(model, parameters, x, motion, payload)
            for name, joint, rows in (*drive_rows(model, motion), *_reversals(model, motion)):
                number = parameters.index(name)
                torque[:, joint] += rows * parameters[number].value
                jacobian[:, joint, number] += rows * parameters.natural_slope(x)[number]
            for name, rows in _tensors(model, motion):
                number = parameters.index(name)
                torque += rows * parameters[number].value
                jacobian[:, :, number] += rows
            _as_logged(model, parameters, torque, jacobian)
            predicted.append(torque)
            jacobians.append(jacobian)
        seen = np.array(measured)
        return cls(parameters, seen, seen - np.array(predicted), np.array(jacobians))

    @property
    def lines(self) -> np.ndarray:
        """Line (2 K + 1,) of every coefficient."""
        above = np.arange(1, self.measured.shape[1] // 2 + 1)
        return np.concatenate([[0], above, above])

    @property
    def size(self) -> np.ndarray:
        """Root mean square (n,) of the coefficients of each joint, N m."""
        return np.sqrt(np.mean(self.measured**2, axis=(0, 1)))

    def first_sigma(self) -> np.ndarray:
        """Initial noise (2 K + 1, n), N m."""
        return np.broadcast_to(_FIRST_SIGMA * self.size, self.measured.shape[1:])


def _links(
    model: RobotModel, parameters: Parameters, x: np.ndarray, motion: PeriodicMotion, payload: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the arm's torques (2 K + 1, n), and their derivatives (2 K + 1, n, p)."""
    states = motion.states(SAMPLES_PER_LINE * motion.lines)
    moved = [k for k, name in enumerate(parameters.names) if name in model.values and not _of_drive(name)]
    about = model.with_values({parameters.names[k]: parameters[k].natural(x[k]) for k in moved})
    arm = ElasticArm(about, payload)

    def rows(robot: RobotModel) -> np.ndarray:
        return motion.rows(periodic_torque(robot, *states, 1 / motion.base_frequency_hz, payload, like=arm))

    def beside(k: int, step: float) -> np.ndarray:
        return rows(about.with_values({parameters.names[k]: parameters[k].natural(x[k] + step)}))

    torque = rows(about)
    jacobian = np.zeros((*torque.shape, len(parameters)))
    for k in moved:
        jacobian[:, :, k] = (beside(k, _STEP) - beside(k, -_STEP)) / (2 * _STEP)
    return torque, jacobian


def _as_logged(model: RobotModel, parameters: Parameters, torque: np.ndarray, jacobian: np.ndarray) -> None:
    """Change true torques (2 K + 1, n) and their derivatives (2 K + 1, n, p) to those of the log, by the drive gains."""
    for joint, name in enumerate(model.joint_names):
        if (gain := f"{name}.{DRIVE_GAIN}") in parameters:
            torque[:, joint] /= parameters[gain].value
            jacobian[:, joint] /= parameters[gain].value
            jacobian[:, joint, parameters.index(gain)] = -torque[:, joint]


def drive_rows(model: RobotModel, motion: PeriodicMotion) -> Iterator[tuple[str, int, np.ndarray]]:
    """Parameter, joint and rows (2 K + 1,) of every column of the drives, evaluated at the full rate."""
    q, dq, ddq = motion.states(motion.samples)
    full = Motion(np.arange(motion.samples), q, dq, ddq, np.zeros_like(q))
    for term in CLASSIC:
        for column in term.columns(model, full, {}):
            yield column.name, column.joint, motion.rows(column.values)


def _reversals(model: RobotModel, motion: PeriodicMotion) -> Iterator[tuple[str, int, np.ndarray]]:
    """Parameter, joint and rows of friction's deviation at a reversal."""
    dq = motion.states(motion.samples)[1]
    rounded = np.nan_to_num(model.drives.coulomb) * (np.tanh(dq / _REVERSAL_VELOCITY) - np.sign(dq))
    for joint, name in enumerate(model.joint_names):
        yield _reversal(name), joint, motion.rows(rounded[:, joint])


def _tensors(model: RobotModel, motion: PeriodicMotion) -> Iterator[tuple[str, np.ndarray]]:
    """Parameter and rows (2 K + 1, n) of every uncertain entry of a tensor."""
    regressor = motion.rows(torque_regressor(model, *motion.states(SAMPLES_PER_LINE * motion.lines)))
    for i, entry, std in uncertain_tensor_entries(model):
        column = len(LINK_PARAMETERS) * i + LINK_PARAMETERS.index(entry)
        yield _tensor(model, i, entry), std * regressor[:, :, column]


def _drive_names(model: RobotModel) -> tuple[str, ...]:
    still = np.zeros((1, model.n))
    motion = Motion(np.zeros(1), still, still, still, still)
    return tuple(dict.fromkeys(column.name for term in CLASSIC for column in term.columns(model, motion, {})))


def _of_drive(name: str) -> bool:
    key = name.rpartition(".")[2].partition("_at_")[0]
    return key in ("rotor_inertia", "viscous", "coulomb", "torque_offset", DRIVE_GAIN, *PARALLEL)


def _reversal(joint: str) -> str:
    return f"{joint}.reversal"


def _tensor(model: RobotModel, i: int, entry: str) -> str:
    return f"{model.joints[i].link}.{entry}.about_com"  # not the parameter at the joint frame
