"""Learning of residual torques, with cross-validation in blocks of time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.estimators import RecordedRows, weighted_least_squares
from flexcal.dynamics.inverse_model import motor_shares
from flexcal.dynamics.regression import ExperimentSystem, RegressionData, fold_numbers, folds, solutions
from flexcal.dynamics.residual.gaussian_process import GaussianProcess
from flexcal.dynamics.residual.learned_torque import LearnedMotor, LearnedResidual, motor_inputs
from flexcal.dynamics.residual.motor_states import MotorStates, motor_states
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.progress import Progress, silent

_ROWS = 1000
"""Largest number of rows of a process, evenly spread over the recordings."""
_FEWEST = 100
"""Least number of rows."""
_WORTH = 0.01
"""Least relative reduction of a motor's cross-validated error for a process to be used."""
_EXACT = 1e-9
"""Residual relative to a motor's torque below which it is rounding."""


@dataclass(frozen=True, eq=False)
class CrossValidatedErrors:
    """Root mean square torques of the motors (n,) in blocks of time, N m: `measured`, residual of the `physical` parameters from the
    other blocks, and residual `together` with the processes learned there.

    `overall` are both errors of all joints, ‖·‖ / ‖Y‖, each motor with its process where that is worth having and else without.
    """

    measured: np.ndarray
    physical: np.ndarray
    together: np.ndarray
    overall: tuple[float, float]


def learn_residual(
    recorded: RecordedRows,
    systems: Sequence[ExperimentSystem],
    estimate: Estimate,
    progress: Progress = silent,
) -> tuple[LearnedResidual, CrossValidatedErrors]:
    """Learn the residual of `estimate` in the rows of its fit, with the equations `systems`; the estimate is not changed.

    Of ten blocks of time each is predicted from the others, less those within a filter's length: by physical parameters (the estimate's,
    moved by what `weighted_least_squares` moves without the block) and the processes. A motor whose error there does not fall by a
    hundredth of itself learns nothing. Raises `FlexcalError` without scikit-learn, and for fewer than 100 rows.
    """
    names = recorded.observation.model.joint_names
    parameters, blocks = _without_blocks(recorded, systems, estimate)
    states, block = _thinned(recorded, systems, parameters)
    if len(states) < _FEWEST:
        raise FlexcalError(
            "E-DYN-029",
            f"{len(states)} rows are too few to learn a residual torque; the minimum is {_FEWEST}; record for longer.",
        )
    missed, left, std = np.full((3, *states.torque.shape), np.nan)
    progress("learning", 0.0)
    for column, number in enumerate(blocks, start=1):
        test = block == number
        others, own = states.where(~_near(states, test, _reach(recorded))), states.where(test)
        missed[test] = own.torque - own.predicted[:, column]
        for k in range(len(names)):
            mean, std[test, k] = _process(others, column, k).predict(_inputs(own, column, k))
            left[test, k] = missed[test, k] - mean
        progress("learning", column / (len(blocks) + 1))
    tested = np.isin(block, blocks)
    measured, physical, together = (_size(v[tested]) for v in (states.torque, missed, left))
    worth = (together < (1.0 - _WORTH) * physical) & (physical > _EXACT * measured)
    inflation = _size((left / std)[tested])
    motors = [
        LearnedMotor(name, _process(states, 0, k), float(inflation[k]))
        if worth[k]
        else LearnedMotor(name, _nothing(states, k, physical[k]), 1.0)
        for k, name in enumerate(names)
    ]
    progress("learning", 1.0)
    shares = motor_shares(recorded.observation.model)
    total, before, after = (
        float(np.linalg.norm(v[tested] @ shares))
        for v in (states.torque, missed, np.where(worth, left, missed))
    )
    errors = CrossValidatedErrors(measured, physical, together, (before / total, after / total))
    return LearnedResidual(tuple(motors), shares), errors


def _without_blocks(
    recorded: RecordedRows, systems: Sequence[ExperimentSystem], estimate: Estimate
) -> tuple[np.ndarray, list[int]]:
    """Parameters (1 + blocks, p): the estimate's, and those without each of the numbered blocks."""
    observation, base = recorded.observation, recorded.base
    kept = list(base.identifiability.kept)
    blocks = folds(systems, observation.column_indices, len(observation.names), kept, _reach(recorded))
    all_rows = weighted_least_squares(RegressionData.of(observation, base, systems)).parameters.coordinates()
    moved = [own - all_rows for own in solutions(blocks, kept, observation.values())]
    values = estimate.parameters.coordinates()
    return np.array([values, *(values + step for step in moved)]), [fold.number for fold in blocks]


def _thinned(
    recorded: RecordedRows, systems: Sequence[ExperimentSystem], parameters: np.ndarray
) -> tuple[MotorStates, np.ndarray]:
    """Rows evenly spread over the recordings, and the block of each (M,)."""
    total = sum(batch.rows for system in systems for batch in system.batches)
    every = -(-total // _ROWS)

    def chosen() -> Iterator[MotorStates]:
        seen = 0
        for states in motor_states(recorded, parameters):
            yield states.where((seen + np.arange(len(states))) % every == 0)
            seen += len(states)

    states = MotorStates.joined(chosen())
    own = fold_numbers(systems)
    lengths = [system.batch_rows for system in systems]
    block = [own[e][n // lengths[e]] for e, n in zip(states.experiment, states.number, strict=True)]
    return states, np.array(block)


def _reach(recorded: RecordedRows) -> int:
    """Rows to either side that share samples with a row."""
    return math.ceil(2 * recorded.decimation.support / recorded.decimation.factor)


def _near(states: MotorStates, test: np.ndarray, reach: int) -> np.ndarray:
    """Mask (M,) of rows that are tested, or share samples with one that is."""
    near = np.zeros(len(states), dtype=bool)
    for experiment in np.unique(states.experiment[test]):
        own = states.experiment == experiment
        numbers = states.number[test & own]
        near |= own & (states.number >= numbers[0] - reach) & (states.number <= numbers[-1] + reach)
    return near


def _inputs(states: MotorStates, column: int, motor: int) -> np.ndarray:
    return motor_inputs(states.position, states.velocity, states.predicted[:, column], motor)


def _process(states: MotorStates, column: int, motor: int) -> GaussianProcess:
    missed = states.torque[:, motor] - states.predicted[:, column, motor]
    return GaussianProcess.fitted(_inputs(states, column, motor), missed)


def _nothing(states: MotorStates, motor: int, error: float) -> GaussianProcess:
    inputs = _inputs(states, 0, motor)
    return GaussianProcess(inputs, np.zeros(len(inputs)), np.ones(3), 0.0, float(error) ** 2)


def _size(values: np.ndarray) -> np.ndarray:
    """Root mean square of every column."""
    return np.sqrt(np.mean(values**2, axis=0))
