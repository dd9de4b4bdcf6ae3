"""Simulated experiments for the frequency layer: linear robots in an exact periodic steady state, one axis with friction."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.linalg

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.frequency.periodic import (
    excitation_torque,
    half_integer_frequency,
    odd_lines,
    reference_trajectory,
)


def make_plan(**changes: object) -> MultisinePlan:
    """Two axes, 3-40 Hz at 0.5 Hz, 200 Hz control: small enough for many runs."""
    values: dict = {
        "name": "test",
        "poses": np.array([[0.1, -0.4, 0.2]]),
        "joints": (0, 2),
        "payload": None,
        "base_frequency_hz": 0.5,
        "lines": odd_lines(0.5, 3.0, 40.0),
        "detection_lines": np.array([], int),
        "amplitude": None,
        "periods": 4,
        "settle_periods": 2,
        "realisations": 4,
        "signs": True,
        "reference_amplitude": 0.0,
        "reference_frequency_hz": half_integer_frequency(0.5, 2.2),
        "kp": np.zeros(3),
        "kd": np.zeros(3),
        "rate_hz": 200.0,
        "torque": "held",
        "seed": 5,
    }
    values |= changes
    if values["amplitude"] is None:
        values["amplitude"] = np.outer(
            np.arange(1.0, len(values["joints"]) + 1), np.ones(len(values["lines"]))
        )
    return MultisinePlan(**values)


@dataclass(frozen=True)
class Mechanism:
    """M q̈ + D q̇ + K q = B τ with the first n_u coordinates measured and driven: motors, then arms behind springs."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    driven: int

    def acceleration_response(self, omega: np.ndarray) -> np.ndarray:
        """G(jω) (L, n, n) from torque to acceleration, continuous time: what is to be found."""
        s = 1j * omega[:, None, None]
        solved = np.linalg.solve(
            s**2 * self.mass + s * self.damping + self.stiffness, np.eye(self.mass.shape[0])
        )
        return (s**2 * solved)[:, : self.driven, : self.driven]

    def held_response(self, z: np.ndarray, time_step: float) -> np.ndarray:
        """Position samples over torque samples (L, n, n) at z = exp(jωT), exact for a torque held over each sample."""
        size = self.mass.shape[0]
        inverse = np.linalg.inv(self.mass)
        a = np.block(
            [[np.zeros((size, size)), np.eye(size)], [-inverse @ self.stiffness, -inverse @ self.damping]]
        )
        b = np.vstack([np.zeros((size, self.driven)), inverse[:, : self.driven]])
        block = np.zeros((2 * size + self.driven, 2 * size + self.driven))
        block[: 2 * size, : 2 * size], block[: 2 * size, 2 * size :] = a, b
        discrete = scipy.linalg.expm(block * time_step)
        ad, bd = discrete[: 2 * size, : 2 * size], discrete[: 2 * size, 2 * size :]
        return np.linalg.solve(z[:, None, None] * np.eye(2 * size) - ad, bd.astype(complex))[:, : self.driven]


def two_axes() -> Mechanism:
    """Two coupled elastic axes, both poles and zeros in 5-20 Hz, weakly held so that no pole is on the circle."""
    motor, arm = np.diag([3.0, 1.5]), np.array([[5.0, 1.2], [1.2, 2.0]])
    spring, damper = np.diag([9e3, 6e3]), np.diag([25.0, 12.0])
    zero = np.zeros((2, 2))
    hold = np.diag([60.0, 30.0, 0.0, 0.0])
    return Mechanism(
        np.block([[motor, zero], [zero, arm]]),
        np.block([[damper, -damper], [-damper, damper]]) + 0.3 * hold,
        np.block([[spring, -spring], [-spring, spring]]) + 10.0 * hold,
        2,
    )


@dataclass(frozen=True)
class LinearCell:
    """Records a plan on a mechanism in the exact periodic steady state; noise is periodic over the record, bins independent.

    With `feedback` (N m/rad) the controller acts on the noisy position: u = r - k (y + v), y = H (u + w).
    """

    mechanism: Mechanism
    position_noise: float = 0.0
    process_noise: float = 0.0
    torque_noise: float = 0.0
    feedback: float = 0.0
    reference_torque: float = 0.0
    even: Callable[[np.ndarray], np.ndarray] | None = None

    def record(self, plan: MultisinePlan, rng: np.random.Generator) -> Iterator[Recording]:
        period = round(plan.rate_hz / plan.base_frequency_hz)
        samples = plan.periods * period
        step = 1.0 / plan.rate_hz
        t = np.arange(samples) * step
        bins = np.arange(1, samples // 2)
        held = self.mechanism.held_response(np.exp(2j * np.pi * bins / samples), step)
        n = self.mechanism.driven
        loop = np.eye(n) + self.feedback * held

        def noise(size: float) -> np.ndarray:
            return np.fft.rfft(size * rng.standard_normal((samples, n)), axis=0)[bins, :, None]

        def time(values: np.ndarray) -> np.ndarray:
            full = np.zeros((samples // 2 + 1, n), complex)
            full[bins] = values[..., 0]
            return np.fft.irfft(full, samples, axis=0)

        for pose, position in enumerate(plan.poses):
            for realisation in range(plan.realisations):
                for experiment in range(n):
                    for sign in (1, -1) if plan.signs else (1,):
                        one = excitation_torque(plan, realisation, experiment, sign)
                        r = np.fft.rfft(np.tile(one, (plan.periods, 1)), axis=0)[bins, :, None]
                        v, w = noise(self.position_noise), noise(self.process_noise)
                        u = np.linalg.solve(loop, r - self.feedback * (held @ w + v))
                        y = held @ (u + w) + v
                        moved = time(y)
                        if self.even is not None:
                            moved = moved + self.even(moved)
                        q = np.tile(position, (samples, 1))
                        torque = np.zeros_like(q)
                        axes = list(plan.joints)
                        q[:, axes] += moved + reference_trajectory(plan, t)[0][:, None]
                        torque[:, axes] = time(u) + self.torque_noise * rng.standard_normal((samples, n))
                        torque[:, axes] += (
                            self.reference_torque
                            * np.sin(2 * np.pi * plan.reference_frequency_hz * t)[:, None]
                        )
                        label = RecordingLabel(pose, realisation, experiment, sign)
                        yield Recording(time_step=step, q=q, torque=torque, arm=None, start=0.0, label=label)


@pytest.fixture(name="make_plan")
def _make_plan() -> Callable[..., MultisinePlan]:
    return make_plan


@pytest.fixture
def mechanism() -> Mechanism:
    return two_axes()


@pytest.fixture
def linear_cell(mechanism: Mechanism) -> Callable[..., LinearCell]:
    """LinearCell of the two axes with the given noise."""
    return lambda **changes: replace(LinearCell(mechanism), **changes)
