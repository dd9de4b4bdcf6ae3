"""Differences of measured and simulated positions as a least-squares problem."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.actuators.servo_parameters import ServoCoordinates
from flexcal.actuators.servo_simulation import ServoSimulation, Windows
from flexcal.estimation import Parameter, Parameters, Problem

_STEP, _DELAY_STEP = 1e-2, 1e-3
"""Steps of the differences, relative to the first value, and in s of the delay: beyond what dry friction makes of smaller ones."""


class OutputError:
    """Measured less simulated positions of all windows `parts`, at coordinates of the actuators."""

    def __init__(
        self, simulation: ServoSimulation, coordinates: ServoCoordinates, parts: Sequence[Windows]
    ) -> None:
        self._simulation, self._coordinates, self._parts = simulation, coordinates, parts
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Measured less simulated positions (W, S, n), rad or m."""
        if self._last is None or not np.array_equal(self._last[0], x):
            self._last = x.copy(), self._difference(x)
        return self._last[1]

    def problem(self, scale: np.ndarray, parameters: Parameters, *, rough: bool) -> Problem:
        """The problem with residuals over `scale` (n,); a group is a window of one joint.

        `rough`: derivatives are taken once, and follow the steps from then on (Broyden 1965), which leads to the optimum in few
        simulations, but not to its covariance.
        """
        windows, samples, n = self._shape
        groups = np.broadcast_to(
            (np.arange(windows)[:, None] * n + np.arange(n))[:, None, :], (windows, samples, n)
        )
        before: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

        def residual(x: np.ndarray) -> np.ndarray:
            return (self.residual(x) / scale).ravel()

        def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            at = residual(x)
            if not rough or not before:
                jacobian = self._jacobian(x, parameters) / np.tile(scale, windows * samples)[:, None]
            else:
                x0, at0, jacobian = before.pop()
                step = x - x0
                weighted = step / self._scales(parameters) ** 2
                gap = at - at0 - jacobian @ step
                jacobian = jacobian + np.outer(gap, weighted) / max(weighted @ step, 1e-300)
            before.append((x.copy(), at, jacobian))
            return at, jacobian

        return Problem(parameters, linearise, residual, groups=groups.ravel())

    @property
    def _shape(self) -> tuple[int, int, int]:
        return sum(map(len, self._parts)), *self._parts[0].measured.shape[1:]

    def _difference(self, x: np.ndarray, *, coarse: bool = False) -> np.ndarray:
        at = self._coordinates.actuators(x)
        return np.concatenate(
            [part.measured - self._simulation.positions(at, part, coarse=coarse) for part in self._parts]
        )

    def _jacobian(self, x: np.ndarray, parameters: Parameters) -> np.ndarray:
        """Derivatives (W S n, p) by differences, with longer time steps: they need less accuracy."""
        at, columns = self._difference(x, coarse=True), []
        for k, step in enumerate(self._steps(parameters)):
            moved = x.copy()
            moved[k] += step
            columns.append(((self._difference(moved, coarse=True) - at) / step).ravel())
        return np.stack(columns, axis=1)

    def _steps(self, parameters: Parameters) -> np.ndarray:
        return np.array([_DELAY_STEP if item.unit == "s" else _STEP * _size(item) for item in parameters])

    def _scales(self, parameters: Parameters) -> np.ndarray:
        """Sizes (p,) of the coordinates, in which a step has its length."""
        return np.array([0.01 if item.unit == "s" else _size(item) for item in parameters])


def _size(item: Parameter) -> float:
    return 1.0 if item.scale == "log" else max(abs(item.prior_mean or 0.0), abs(item.value), 1e-12)
