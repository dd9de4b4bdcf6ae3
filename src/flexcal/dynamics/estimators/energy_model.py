"""Energy model: work of the motors between two instants, without accelerations (Gautier & Khalil 1988)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import linear_fit
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.scalar_equations import ScalarEquations
from flexcal.dynamics.estimators.wls import noise_levels
from flexcal.dynamics.inverse_model import Column, Coupling, Memory, RotorInertia
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.torques import energy_regressor

_WINDOW = 0.1
"""Length of the windows, s."""


def energy_least_squares(recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ of [H(t) − H(t − T)] χ = ∫ q̇ᵀτ dt over windows of 0.1 s, each experiment weighted by its own noise.

    H is the energy of links and rotors; friction is integrated as the torque is, by the trapezoidal rule at the full rate. A window
    begins with every sample, so that windows overlap, and so do the errors of rows that follow each other: the covariance of
    `linear_fit` accounts for that. Raises `FlexcalError` as `noise_levels` and `linear_fit` do.
    """
    data = recorded.observed_as(EnergyModel(recorded.observation))
    return linear_fit(data, noise_levels(data))


@dataclass(frozen=True, eq=False)
class EnergyModel(ScalarEquations):
    """Energy equation, J: energy supplied to an `observation` in the 0.1 s before a sample, or since the experiment began.

    Of its terms, those with inertia count by their energy and the others by their work; a term that is itself made from
    accelerations, as a friction by load, keeps them.
    """

    label = "the energy of all joints"

    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        own = {} if memory is None else memory
        power, stored = self._power(motion, own), self._stored(motion)
        before: _Account = own.get("energy") or _Account.opened(motion.time[0], power[:, 0])
        steps = np.diff(motion.time, prepend=before.end)
        mean = 0.5 * (power + np.hstack([before.power[:, None], power[:, :-1]]))
        work = before.work[:, None] + np.cumsum(steps * mean, axis=1)
        time = np.append(before.time, motion.time)
        energy = np.hstack([before.energy, stored + work])
        begins = np.searchsorted(time, motion.time - _WINDOW * (1 + 1e-6))
        kept = slice(begins[-1], None)
        own["energy"] = _Account(time[-1], power[:, -1], work[:, -1], time[kept], energy[:, kept])
        return energy[:, -len(motion) :] - energy[:, begins]

    def _stored(self, motion: Motion) -> np.ndarray:
        """Energy of links and rotors by parameter (p + 1, N), the last row zero."""
        energy = np.zeros((len(self.names) + 1, len(motion)))
        energy[: len(LINK_PARAMETERS) * self.model.n] = energy_regressor(self.model, motion.q, motion.dq).T
        for column in self._columns(replace(motion, ddq=motion.dq), {}, inertial=True):
            energy[self.names.index(column.name)] += 0.5 * motion.dq[:, column.joint] * column.values
        return energy

    def _power(self, motion: Motion, memory: Memory) -> np.ndarray:
        """Dissipated power by parameter, and power of motors and external loads (p + 1, N)."""
        power = np.zeros((len(self.names) + 1, len(motion)))
        for column in self._columns(motion, memory, inertial=False):
            power[self.names.index(column.name)] += motion.dq[:, column.joint] * column.values
        power[-1] = np.sum(motion.dq * motion.net, axis=1)
        return power

    def _columns(self, motion: Motion, memory: Memory, *, inertial: bool) -> Iterator[Column]:
        for term in self.observation.terms:
            if not inertial or isinstance(term, RotorInertia | Coupling):
                for column in term.columns(self.model, motion, memory):
                    if column.name.rpartition(".")[2].startswith("rotor_inertia") == inertial:
                        yield column


@dataclass(frozen=True, eq=False)
class _Account:
    """Energy supplied until the sample at `end` (s), by parameter and by the motors.

    `power` and `work` (p + 1,) are those at the end; `energy` (p + 1, H) is stored energy and work together at the last samples' `time`.
    """

    end: float
    power: np.ndarray
    work: np.ndarray
    time: np.ndarray
    energy: np.ndarray

    @classmethod
    def opened(cls, time: float, power: np.ndarray) -> _Account:
        """Account at the first sample, with no sample stored."""
        return cls(time, power, np.zeros_like(power), np.zeros(0), np.zeros((len(power), 0)))
