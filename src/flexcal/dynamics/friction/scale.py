"""Speed, stroke and duration of recordings, which scale the shapes of friction terms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.inverse_model import MotorAxis, Observation, motor_axes
from flexcal.dynamics.regression import ExperimentSystem


@dataclass(frozen=True, eq=False)
class ExcitationScale:
    """Scales of a motion for the shapes of friction terms.

    `speed` and `stroke` (n,) are those of the motor axes: the root mean square of ṡ, and its square over that of s̈; `duration` (s) is
    that of the longest recording; `inertials` (10 n,) are the links'. An axis that does not move counts as if both were 1.
    """

    speed: np.ndarray
    stroke: np.ndarray
    duration: float
    inertials: np.ndarray

    @classmethod
    def of(
        cls, systems: Sequence[ExperimentSystem], observation: Observation, inertials: np.ndarray
    ) -> ExcitationScale:
        """Scale from the equations of an observation with the classic terms."""
        axes = motor_axes(observation.model)
        speed, push = (
            np.array([_size(systems, observation, axis, kind) for axis in axes])
            for kind in ("viscous", "rotor_inertia")
        )
        moves = (speed > 0) & (push > 0)
        stroke = np.where(moves, speed**2, 1.0) / np.where(moves, push, 1.0)
        return cls(np.where(moves, speed, 1.0), stroke, max(s.duration for s in systems), inertials)


def _size(systems: Sequence[ExperimentSystem], observation: Observation, axis: MotorAxis, kind: str) -> float:
    """Root mean square of ṡ or s̈ of an axis: the sum of its column of that `kind` and those of its coupling at its own joint."""
    own = f"{axis.name}.{kind}"
    column_indices = observation.column_indices[axis.joint]
    chosen = [own, *(name for name in observation.names if name.startswith(f"{own}_at_"))]
    columns = np.searchsorted(column_indices, [observation.names.index(name) for name in chosen])
    square = sum(
        np.sum(batch.factors[axis.joint][:, columns].sum(axis=1) ** 2) for s in systems for batch in s.batches
    )
    return math.sqrt(square / sum(batch.rows for s in systems for batch in s.batches))
