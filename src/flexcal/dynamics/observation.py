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

    @property
    def labels(self) -> tuple[str, ...]:
        """The joints."""
        return self.model.joint_names

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
    def _links(self) -> list[slice | np.ndarray]:
        """For every joint which inertial columns it can feel."""
        found: list[slice | np.ndarray] = []
        for members in self.members:
            numbers = members[members < len(INERTIAL) * self.model.n]
            joined = numbers[-1] - numbers[0] + 1 == len(numbers)
            found.append(slice(numbers[0], numbers[-1] + 1) if joined else numbers)
        return found

    @cached_property
    def _drives(self) -> np.ndarray:
        """Row among `systems` of every drive column, in the order in which the terms give them."""
        number = {name: i for i, name in enumerate(self.names)}
        starts = np.cumsum([0, *self.widths])
        rows = [
            starts[column.joint] + np.searchsorted(self.members[column.joint], number[column.name])
            for column in self._at_rest
        ]
        return np.array(rows, dtype=int)

    @property
    def widths(self) -> list[int]:
        """For every joint the number of its columns, and one for its torque."""
        return [len(members) + 1 for members in self.members]

    def systems(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """For every joint its columns and, last, its torque, below each other (Σ widths, N), at every sample of the motion.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without.
        """
        links = torque_regressor(self.model, motion.q, motion.dq, motion.ddq).transpose(1, 2, 0)
        found = np.empty((sum(self.widths), len(motion)))
        start = 0
        for joint, (felt, width) in enumerate(zip(self._links, self.widths, strict=True)):
            part = links[joint, felt]
            found[start : start + len(part)] = part
            start += width
            found[start - 1] = motion.torque[:, joint]
        values = (column.values for column in self._drive_columns(motion, {} if memory is None else memory))
        for place, column in zip(self._drives, values, strict=True):
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
        systems = np.split(self.systems(motion), np.cumsum(self.widths)[:-1])
        return [system[:-1] for system in systems]

    def values(self) -> np.ndarray:
        """The model's values of all columns (p,), zero where it knows none."""
        known = self.model.values
        return np.nan_to_num([known[name] for name in self.names])
