"""Interface of equations that are linear in the dynamic parameters, for samples of a motion."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from flexcal.dynamics.inverse_model.drive_terms import Memory
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel


class Equations(Protocol):
    """One or several equations per sample: the torques of all joints, or a scalar in their place."""

    @property
    def model(self) -> RobotModel:
        """Robot model."""
        ...

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        ...

    @property
    def labels(self) -> tuple[str, ...]:
        """Name of each equation in messages."""
        ...

    @property
    def undriven(self) -> range:
        """Numbers of the equations whose right-hand side is zero: those of bearings."""
        ...

    @cached_property
    def column_indices(self) -> tuple[np.ndarray, ...]:
        """Numbers of the parameters in each equation, ascending."""
        ...

    @cached_property
    def projection(self) -> tuple[np.ndarray, ...]:
        """Matrix (reduced, columns) of each equation from its reduced columns: W = W_reduced · projection."""
        ...

    @cached_property
    def widths(self) -> list[int]:
        """Number of reduced columns of each equation, and one for its right-hand side."""
        ...

    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """Reduced columns and, last, right-hand side of each equation, below each other (Σ widths, N), at every sample.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without.
        """
        ...

    def follow(self, motion: Motion, memory: Memory) -> None:
        """Advance `memory` to the end of a motion whose columns are not needed."""
        ...

    def values(self) -> np.ndarray:
        """Model values of all parameters (p,), zero if unknown."""
        ...
