"""The observation matrix of a robot, joint by joint: link inertials and drive terms (Eq. 2.20)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.dynamics.drive_terms import Column, DriveTerm, Memory
from flexcal.dynamics.motion import Motion
from flexcal.model import RobotModel, inertial_names, torque_regressor
from flexcal.model.regressor import INERTIAL


@dataclass(frozen=True, eq=False)
class Observation:
    """Which parameters the torques depend on, and how."""

    model: RobotModel
    terms: tuple[DriveTerm, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all columns: the links' inertials in chain order, then the terms'."""
        drives = [column.name for column in self._at_rest]
        return (*inertial_names(self.model), *dict.fromkeys(drives))

    @cached_property
    def members(self) -> tuple[np.ndarray, ...]:
        """For every joint the numbers of the columns that it can feel, ascending."""
        felt: list[set[int]] = [set() for _ in range(self.model.n)]
        for i in range(self.model.n):
            at = i
            while at >= 0:
                felt[at].update(range(len(INERTIAL) * i, len(INERTIAL) * (i + 1)))
                at = self.model.joints[at].parent
        for column in self._at_rest:
            felt[column.joint].add(self.names.index(column.name))
        return tuple(np.array(sorted(numbers)) for numbers in felt)

    @property
    def _at_rest(self) -> list[Column]:
        state = np.zeros((1, self.model.n))
        still = Motion(np.zeros(1), state, state, state, state)
        return [column for term in self.terms for column in term.columns(self.model, still, {})]

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Row among `stacked` of every entry (joint, inertial parameter) that counts, and of every drive column in its order."""
        starts = np.cumsum([0, *(len(members) for members in self.members)])
        inertial = np.full((self.model.n, len(INERTIAL) * self.model.n), -1)
        for joint, members in enumerate(self.members):
            links = members[members < inertial.shape[1]]
            inertial[joint, links] = starts[joint] + np.arange(len(links))
        number = {name: i for i, name in enumerate(self.names)}
        drives = [
            starts[column.joint] + np.searchsorted(self.members[column.joint], number[column.name])
            for column in self._at_rest
        ]
        return inertial, np.array(drives, dtype=int)

    def stacked(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """The columns of all joints below each other (Σ members, N), at every sample of the motion.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without.
        """
        inertial, drives = self._places
        links = torque_regressor(self.model, motion.q, motion.dq, motion.ddq).transpose(1, 2, 0)
        counts = inertial >= 0
        found = np.empty((sum(len(members) for members in self.members), len(motion)))
        found[inertial[counts]] = links[counts]
        values = (column.values for column in self._drive_columns(motion, {} if memory is None else memory))
        for place, column in zip(drives, values, strict=True):
            found[place] = column
        return found

    def follow(self, motion: Motion, memory: Memory) -> None:
        """Bring `memory` up to the end of a motion whose columns are not needed."""
        for _ in self._drive_columns(motion, memory):
            pass

    def _drive_columns(self, motion: Motion, memory: Memory) -> Iterator[Column]:
        for term in self.terms:
            yield from term.columns(self.model, motion, memory)

    def columns(self, motion: Motion) -> list[np.ndarray]:
        """For every joint its columns (members, N) at every sample of the motion."""
        ends = np.cumsum([len(members) for members in self.members])
        return np.split(self.stacked(motion), ends[:-1])

    def values(self) -> np.ndarray:
        """The model's values of all columns (p,), zero where it knows none."""
        known = self.model.values
        return np.nan_to_num([known[name] for name in self.names])
