"""Position, speed, measured and predicted torque of each motor, row by row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from flexcal.dynamics.estimators import RecordedRows
from flexcal.dynamics.inverse_model import Column, Memory, motor_axes, motor_shares
from flexcal.dynamics.regression import regression_blocks
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class MotorStates:
    """States of M rows; `number` (M,) counts the rows of each one's `experiment` (M,), whatever is left out.

    `position` and `velocity` (M, n) are those of the motors' axes, `torque` (M, n) what the motors gave and `predicted` (M, K, n) what
    each of K estimates asks of them, all through the same decimation.
    """

    experiment: np.ndarray
    number: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray
    predicted: np.ndarray

    def __len__(self) -> int:
        return len(self.number)

    def where(self, keep: np.ndarray) -> MotorStates:
        """Rows of the mask `keep` (M,)."""
        return MotorStates(*(getattr(self, field.name)[keep] for field in fields(self)))

    @classmethod
    def joined(cls, parts: Iterable[MotorStates]) -> MotorStates:
        """Concatenated states."""
        states = list(parts)
        return cls(*(np.concatenate([getattr(part, field.name) for part in states]) for field in fields(cls)))


def motor_states(recorded: RecordedRows, parameters: np.ndarray) -> Iterator[MotorStates]:
    """States of all rows, in one pass and block by block, with the torques predicted by `parameters` (K, p)."""
    observation = recorded.observation
    wide = replace(observation, terms=(*observation.terms, _AxisStates()))
    beyond = np.zeros((len(parameters), len(wide.names) - len(observation.names)))
    values = np.hstack([parameters, beyond])
    to_motors = np.linalg.inv(motor_shares(observation.model))
    for experiment, (log, window) in enumerate(zip(recorded.experiments, recorded.windows, strict=True)):
        for block in regression_blocks(wide, log, recorded.decimation, window):
            kept = block.where(~block.still) if recorded.mask_standstill else block
            states = np.array(
                [own[-3:-1] for own in kept.reduced]
            )  # the last of a joint's columns, before its torque
            yield MotorStates(
                np.full(len(kept), experiment),
                kept.number,
                states[:, 0].T,
                states[:, 1].T,
                kept.torque.T @ to_motors,
                np.stack([kept.predicted(wide.column_indices, own).T @ to_motors for own in values], axis=1),
            )


@dataclass(frozen=True)
class _AxisStates:
    """Position s and speed ṡ of every motor's axis, in columns of the motor's own joint."""

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        for axis in motor_axes(model):
            yield Column(f"{axis.name}.axis_position", axis.joint, axis.of(motion.q))
            yield Column(f"{axis.name}.axis_velocity", axis.joint, axis.of(motion.dq))
