"""One equation per sample for all joints together, from the columns of their torques."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from flexcal.dynamics.inverse_model import Memory, Observation
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class ScalarEquations(ABC):
    """Scalar equation called `label` in which every parameter of an `observation` appears."""

    observation: Observation
    label: ClassVar[str]

    @abstractmethod
    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """As `Equations.reduced`."""

    @property
    def model(self) -> RobotModel:
        return self.observation.model

    @cached_property
    def names(self) -> tuple[str, ...]:
        return self.observation.names

    @property
    def labels(self) -> tuple[str, ...]:
        return (self.label,)

    @property
    def undriven(self) -> range:
        return range(0)

    @cached_property
    def column_indices(self) -> tuple[np.ndarray, ...]:
        return (np.arange(len(self.names)),)

    @cached_property
    def projection(self) -> tuple[np.ndarray, ...]:
        return (np.eye(len(self.names)),)

    @cached_property
    def widths(self) -> list[int]:
        return [len(self.names) + 1]

    def follow(self, motion: Motion, memory: Memory) -> None:
        self.observation.follow(motion, memory)

    def values(self) -> np.ndarray:
        return self.observation.values()
