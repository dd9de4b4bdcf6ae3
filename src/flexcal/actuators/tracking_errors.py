"""Errors of simulated joint positions, beside those of taking the command for the position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.actuators.servo_simulation import ServoSimulation, Windows
from flexcal.export import Actuators


@dataclass(frozen=True, eq=False)
class TrackingErrors:
    """Root mean squares (n,), rad or m, over `samples`: `simulated` less measured position, and `commanded` less measured."""

    simulated: np.ndarray
    commanded: np.ndarray
    samples: int

    @property
    def share(self) -> np.ndarray:
        """Simulated over commanded (n,): 0 where the simulation is exact, 1 where it says no more than the command."""
        return self.simulated / np.maximum(self.commanded, np.finfo(float).tiny)

    @classmethod
    def of(
        cls, simulation: ServoSimulation, actuators: Actuators, parts: Sequence[Windows]
    ) -> TrackingErrors:
        """Over all windows of some logs."""
        squares, count = np.zeros((2, len(actuators.stiffness))), 0
        for windows in parts:
            if not len(windows):
                continue
            reached = simulation.positions(actuators, windows)
            numbers = windows.first[:, None] + windows.settled + 1 + np.arange(reached.shape[1])
            squares[0] += np.sum((reached - windows.measured) ** 2, axis=(0, 1))
            squares[1] += np.sum((windows.log.command[numbers] - windows.measured) ** 2, axis=(0, 1))
            count += numbers.size
        rms = np.sqrt(squares / max(count, 1))
        return cls(rms[0], rms[1], count)
