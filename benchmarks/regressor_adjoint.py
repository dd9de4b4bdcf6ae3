"""Gradient of criteria of an exciting trajectory by its coefficients: the regressor's adjoint against forward differences."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.dynamics import best_times
from flexcal.design.optimality import ConditionNumberCriterion, Criterion, DOptimal
from flexcal.design.trajectories import BaseRegressor
from flexcal.design.trajectories.limit_usage import MotionLimits
from flexcal.design.trajectories.motion_space import MotionSpace
from flexcal.model.robot import RobotModel

ROBOT = Path(__file__).parents[1] / "examples" / "tx90l" / "robot.yaml"
PERIOD, HARMONICS, SAMPLES = 5.0, 5, 500
REPEATS = 50
COST = 4.0


def run() -> list[tuple[str, float, str]]:
    """Their time over ours, and limit over measured."""
    model = RobotModel.from_yaml(ROBOT, estimates=False)
    columns = BaseRegressor.of(model)
    space = MotionSpace.of("fourier", HARMONICS, PERIOD, SAMPLES, MotionLimits.of(model))
    x = 0.3 * np.random.default_rng(1).normal(size=space.shape)
    motion, slopes = space.motion(x), columns.write(space.motion(x))
    found = [
        _gradient(Excitation(columns, space, criterion), x)
        for criterion in (DOptimal(), ConditionNumberCriterion())
    ]
    forward, adjoint = best_times(
        lambda: [columns.write(motion) for _ in range(REPEATS)],
        lambda: [columns.by_motion(motion, slopes) for _ in range(REPEATS)],
    )
    note = f"{1e6 * adjoint / REPEATS / SAMPLES:.2f} µs a sample, the columns {1e6 * forward / REPEATS / SAMPLES:.2f}"
    return [
        *found,
        (f"limit {COST:g} evaluations of the columns for their adjoint", COST * forward / adjoint, note),
    ]


def _gradient(excitation: Excitation, x: np.ndarray) -> tuple[str, float, str]:
    theirs, ours = best_times(
        lambda: excitation.forward_differences(x), lambda: [excitation.gradient(x) for _ in range(REPEATS)]
    )
    exact = excitation.central_differences(x)
    rough, close = (
        np.abs(found - exact).max() / np.abs(exact).max()
        for found in (excitation.forward_differences(x), excitation.gradient(x))
    )
    return (
        f"gradient of {excitation.criterion.name} by {x.size} coefficients",
        theirs / (ours / REPEATS),
        f"{1e3 * theirs:.1f} ms, ours {1e3 * ours / REPEATS:.2f}; off by {rough:.0e}, ours {close:.0e}",
    )


class Excitation:
    """A criterion of the information of a motion on the base parameters, by its coordinates (k, n)."""

    def __init__(self, columns: BaseRegressor, space: MotionSpace, criterion: Criterion) -> None:
        self.columns, self.space, self.criterion = columns, space, criterion

    def value(self, x: np.ndarray) -> float:
        found = self.columns.write(self.space.motion(x))
        return self.criterion.merit(np.sum(found @ found.transpose(0, 2, 1), axis=0))

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """By the adjoint, from ∂f/∂W = 2 W ∂f/∂M."""
        motion = self.space.motion(x)
        found = self.columns.write(motion)
        slope = 2 * self.criterion.gradient(np.sum(found @ found.transpose(0, 2, 1), axis=0))
        by_motion = self.columns.by_motion(motion, slope @ found)
        return self.space.by_coordinates(by_motion).reshape(x.shape)

    def forward_differences(self, x: np.ndarray, step: float = 1e-7) -> np.ndarray:
        start = self.value(x)
        steps = step * np.eye(x.size).reshape(-1, *x.shape)
        return np.array([self.value(x + s) - start for s in steps]).reshape(x.shape) / step

    def central_differences(self, x: np.ndarray, step: float = 5e-4) -> np.ndarray:
        """Of sixth order, to check the others."""
        steps = step * np.eye(x.size).reshape(-1, *x.shape)
        odd = np.array([[self.value(x + k * s) - self.value(x - k * s) for k in (1, 2, 3)] for s in steps])
        return (odd @ [45, -9, 1] / (60 * step)).reshape(x.shape)
