"""Power model: power of all motors, one equation per sample (Gautier 1997)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import linear_fit
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.scalar_equations import ScalarEquations
from flexcal.dynamics.estimators.wls import noise_levels
from flexcal.dynamics.inverse_model import Memory
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate


def power_least_squares(recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ of q̇ᵀW χ = q̇ᵀτ, each experiment weighted by its own noise; raises `FlexcalError` as `noise_levels` and `linear_fit`
    do.

    The products are formed at the full rate, before the decimation. One equation stands for n, and the noise of the strong joints
    hides what the weak ones say; it grows with the speed too. The covariance of `linear_fit` accounts for that, the estimate does not.
    """
    data = recorded.observed_as(PowerModel(recorded.observation))
    return linear_fit(data, noise_levels(data))


@dataclass(frozen=True, eq=False)
class PowerModel(ScalarEquations):
    """Power equation, W: q̇ᵀ times the torques and columns of an `observation`."""

    label = "the power of all joints"

    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        systems = self.observation.systems(motion, memory)
        power = np.zeros((len(self.names) + 1, len(motion)))
        for speed, column_indices, system in zip(
            motion.dq.T, self.observation.column_indices, systems, strict=True
        ):
            power[column_indices] += speed * system[:-1]
            power[-1] += speed * system[-1]
        return power
