"""Gradient of log det WᵀW (base columns) by a Fourier trajectory's coefficients: the regressor's adjoint against forward differences."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.dynamics import best_times
from flexcal.dynamics import BaseParameters, Observation
from flexcal.model import RobotModel
from flexcal.model.regressor import write_torque_regressor
from flexcal.model.regressor_adjoint import placed_regressor_adjoint

ROBOT = Path(__file__).parents[1] / "examples" / "tx90l" / "robot.yaml"
BASE_FREQUENCY_HZ, HARMONICS, SAMPLES = 0.2, 5, 500
REPEATS = 50
COST = 4.0


def run() -> list[tuple[str, float, str]]:
    """Their time over ours, and limit over measured."""
    model = RobotModel.from_yaml(ROBOT, estimates=False)
    criterion = Criterion(model)
    x = np.random.default_rng(1).normal(scale=0.3, size=(1 + 2 * HARMONICS, model.n))
    motion = criterion.series @ x
    theirs, ours, forward, adjoint = best_times(
        lambda: criterion.forward_differences(x),
        lambda: [criterion.gradient(x) for _ in range(REPEATS)],
        lambda: [criterion.write_columns(motion) for _ in range(REPEATS)],
        lambda: [criterion.by_motion(motion) for _ in range(REPEATS)],
    )
    ours, forward, adjoint = (seconds / REPEATS for seconds in (ours, forward, adjoint))
    exact = criterion.central_differences(x)
    rough, close = (
        np.abs(found - exact).max() / np.abs(exact).max()
        for found in (criterion.forward_differences(x), criterion.gradient(x))
    )
    return [
        (
            f"gradient by {x.size} coefficients: forward differences",
            theirs / ours,
            f"{1e3 * theirs:.1f} ms, ours {1e3 * ours:.2f}; off by {rough:.0e}, ours {close:.0e}",
        ),
        (
            f"limit {COST:g} regressors for its adjoint",
            COST * forward / adjoint,
            f"{1e6 * adjoint / SAMPLES:.2f} µs a sample, the regressor {1e6 * forward / SAMPLES:.2f}",
        ),
    ]


class Criterion:
    """log det of the information of a motion on the base parameters, by its coefficients (11, n): centre, sines, cosines."""

    def __init__(self, model: RobotModel) -> None:
        self.model = model
        base = BaseParameters.of(Observation(model, ())).found.kept
        self.places = np.full((model.n, 10 * model.n), -1)
        self.places[:, base] = np.arange(model.n * len(base)).reshape(model.n, -1)
        k = np.arange(1, HARMONICS + 1)
        phase, rate = 2 * np.pi * np.arange(SAMPLES)[:, None] / SAMPLES * k, 2 * np.pi * BASE_FREQUENCY_HZ * k
        sine, cosine, still = np.sin(phase), np.cos(phase), np.zeros((SAMPLES, 1))
        q = np.hstack([still + 1, sine, cosine])
        dq = np.hstack([still, rate * cosine, -rate * sine])
        ddq = np.hstack([still, -(rate**2) * sine, -(rate**2) * cosine])
        self.series = np.array([q, dq, ddq])
        self.columns, self.weights = np.zeros((2, model.n, len(base), SAMPLES))

    def write_columns(self, motion: np.ndarray) -> None:
        q, dq, ddq = motion
        write_torque_regressor(self.model, q, dq, ddq, self.places, self.columns.reshape(-1, SAMPLES))

    def by_motion(self, motion: np.ndarray) -> np.ndarray:
        q, dq, ddq = motion
        return placed_regressor_adjoint(
            self.model, q, dq, ddq, self.places, self.weights.reshape(-1, SAMPLES)
        )

    def information(self, motion: np.ndarray) -> np.ndarray:
        """WᵀW."""
        self.write_columns(motion)
        return np.sum(self.columns @ self.columns.transpose(0, 2, 1), axis=0)

    def value(self, x: np.ndarray) -> float:
        return np.linalg.slogdet(self.information(self.series @ x))[1]

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """By the adjoint, from ∂f/∂W = 2 W (WᵀW)⁻¹."""
        motion = self.series @ x
        np.matmul(2 * np.linalg.inv(self.information(motion)), self.columns, out=self.weights)
        return np.sum(self.series.transpose(0, 2, 1) @ self.by_motion(motion), axis=0)

    def forward_differences(self, x: np.ndarray, step: float = 1e-7) -> np.ndarray:
        start = self.value(x)
        steps = step * np.eye(x.size).reshape(-1, *x.shape)
        return np.array([self.value(x + s) - start for s in steps]).reshape(x.shape) / step

    def central_differences(self, x: np.ndarray, step: float = 1e-3) -> np.ndarray:
        """Of sixth order, to check the others."""
        steps = step * np.eye(x.size).reshape(-1, *x.shape)
        odd = np.array([[self.value(x + k * s) - self.value(x - k * s) for k in (1, 2, 3)] for s in steps])
        return (odd @ [45, -9, 1] / (60 * step)).reshape(x.shape)
