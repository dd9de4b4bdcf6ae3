"""Interface of equations that are linear in the dynamic parameters, for samples of a motion."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from flexcal.dynamics.inverse_model.drive_terms import Memory
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel


class Equations(Protocol):
    """One or several equations a sample: the torques of all joints, or a scalar that stands for all of them."""

    @property
    def model(self) -> RobotModel:
        """The robot."""
        ...

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        ...

    @property
    def labels(self) -> tuple[str, ...]:
        """What messages call each equation."""
        ...

    @property
    def undriven(self) -> range:
        """Numbers of the equations whose right-hand side is zero: those of bearings."""
        ...

    @cached_property
    def column_indices(self) -> tuple[np.ndarray, ...]:
        """For every equation the numbers of the parameters that stand in it, ascending."""
        ...

    @cached_property
    def projection(self) -> tuple[np.ndarray, ...]:
        """For every equation (reduced, columns): its columns from its reduced ones, W = W_reduced · projection."""
        ...

    @cached_property
    def widths(self) -> list[int]:
        """For every equation the number of its reduced columns, and one for its right-hand side."""
        ...

    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """For every equation its reduced columns and, last, its right-hand side, below each other (Σ widths, N), at every sample.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without.
        """
        ...

    def follow(self, motion: Motion, memory: Memory) -> None:
        """Bring `memory` up to the end of a motion whose columns are not needed."""
        ...

    def values(self) -> np.ndarray:
        """The model's values of all parameters (p,), zero where it knows none."""
        ...
