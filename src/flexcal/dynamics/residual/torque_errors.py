"""Relative torque errors with and without a learned residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.estimators import RecordedRows
from flexcal.dynamics.residual.learned_torque import LearnedResidual
from flexcal.dynamics.residual.motor_states import motor_states

_NORMAL = 1.959964
"""Half width of a 95 % interval, in standard deviations."""


@dataclass(frozen=True, eq=False)
class LearnedTorqueErrors:
    """Norms of the joints' torques (n,), N m: `measured`, residual of the `physical` parameters, and residual with the learned torque;
    and the share of rows `inside` (n,) the 95 % prediction intervals.
    """

    measured: np.ndarray
    physical: np.ndarray
    together: np.ndarray
    inside: np.ndarray

    @property
    def overall(self) -> tuple[float, float]:
        """Relative error of all joints, without and with the learned torque."""
        total = np.linalg.norm(self.measured)
        return float(np.linalg.norm(self.physical) / total), float(np.linalg.norm(self.together) / total)


def residual_errors(
    learned: LearnedResidual, recorded: RecordedRows, parameters: np.ndarray
) -> LearnedTorqueErrors:
    """Errors from one pass over the recorded rows, for the estimate of `parameters` (p,)."""
    squares, inside, count = np.zeros((3, len(learned.motors))), np.zeros(len(learned.motors)), 0
    for states in motor_states(recorded, parameters[None]):
        predicted = states.predicted[:, 0]
        added, std = learned.of_motors(states.position, states.velocity, predicted)
        torque, missed = states.torque @ learned.shares, (states.torque - predicted) @ learned.shares
        squares += [np.sum(v**2, axis=0) for v in (torque, missed, missed - added)]
        inside += np.sum(np.abs(missed - added) <= _NORMAL * std, axis=0)
        count += len(states)
    measured, physical, together = np.sqrt(squares)
    return LearnedTorqueErrors(measured, physical, together, inside / count)
