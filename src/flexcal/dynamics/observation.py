"""The observation matrix of a robot, joint by joint: link inertials and drive terms (Eq. 2.20)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.dynamics.drive_terms import Column, DriveTerm, Memory
from flexcal.dynamics.link_columns import LinkColumns, link_columns
from flexcal.dynamics.motion import Motion
from flexcal.model import RobotModel, inertial_names, torque_regressor
from flexcal.model.regressor import INERTIAL, write_torque_regressor


@dataclass(frozen=True, eq=False)
class Observation:
    """Which parameters the torques depend on, and how.

    Of the columns of a joint that the links bring, some always are combinations of others, whatever the motion is. `reduced` leaves them
    out, and `spread` (one a joint) says how the others give them back: W = W_reduced · spread.
    """

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
        return tuple(
            np.concatenate([links.felt, own]) for links, own in zip(self._links, self._drives, strict=True)
        )

    @cached_property
    def spread(self) -> tuple[np.ndarray, ...]:
        """For every joint (reduced, members): its columns from its reduced ones."""
        found = []
        for links, own in zip(self._links, self._drives, strict=True):
            kept, felt = links.spread.shape
            spread = np.eye(kept + len(own), felt + len(own), k=felt - kept)
            spread[:kept, :felt] = links.spread
            found.append(spread)
        return tuple(found)

    @cached_property
    def _links(self) -> tuple[LinkColumns, ...]:
        return link_columns(self.model)

    @cached_property
    def _at_rest(self) -> list[Column]:
        state = np.zeros((1, self.model.n))
        still = Motion(np.zeros(1), state, state, state, state)
        return list(self._drive_columns(still, {}))

    @cached_property
    def _drives(self) -> list[np.ndarray]:
        """For every joint the numbers of the drive columns that it feels, ascending."""
        number = {name: i for i, name in enumerate(self.names)}
        felt: list[set[int]] = [set() for _ in range(self.model.n)]
        for column in self._at_rest:
            felt[column.joint].add(number[column.name])
        return [np.array(sorted(numbers), dtype=int) for numbers in felt]

    @cached_property
    def widths(self) -> list[int]:
        """For every joint the number of its reduced columns, and one for its torque."""
        return [len(spread) + 1 for spread in self.spread]

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of `reduced`: of the links' entries (n, 10 n), -1 for those left out, and of every drive column in the terms' order."""
        starts = np.cumsum([0, *self.widths])
        links = np.full((self.model.n, len(INERTIAL) * self.model.n), -1)
        for joint, own in enumerate(self._links):
            links[joint, own.kept] = starts[joint] + np.arange(len(own.kept))
        number = {name: i for i, name in enumerate(self.names)}
        drives = [
            starts[c.joint]
            + len(self._links[c.joint].kept)
            + np.searchsorted(self._drives[c.joint], number[c.name])
            for c in self._at_rest
        ]
        return links, np.array(drives, dtype=int)

    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """For every joint its reduced columns and, last, its torque, below each other (Σ widths, N), at every sample of the motion.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without.
        """
        links, drives = self._places
        found = np.empty((sum(self.widths), len(motion)))
        write_torque_regressor(self.model, motion.q, motion.dq, motion.ddq, links, found)
        found[np.cumsum(self.widths) - 1] = motion.torque.T
        columns = self._drive_columns(motion, {} if memory is None else memory)
        for place, column in zip(drives, columns, strict=True):
            found[place] = column.values
        return found

    def systems(self, motion: Motion, memory: Memory | None = None) -> list[np.ndarray]:
        """For every joint all its columns and, last, its torque (members + 1, N), where `reduced` leaves some out."""
        parts = np.split(self.reduced(motion, memory), np.cumsum(self.widths)[:-1])
        return [np.vstack([s.T @ part[:-1], part[-1]]) for s, part in zip(self.spread, parts, strict=True)]

    def follow(self, motion: Motion, memory: Memory) -> None:
        """Bring `memory` up to the end of a motion whose columns are not needed."""
        for _ in self._drive_columns(motion, memory):
            pass

    def _drive_columns(self, motion: Motion, memory: Memory) -> Iterator[Column]:
        for term in self.terms:
            yield from term.columns(self.model, motion, memory)

    def columns(self, motion: Motion) -> list[np.ndarray]:
        """For every joint all its columns (members, N) at every sample of the motion, none left out."""
        links = torque_regressor(self.model, motion.q, motion.dq, motion.ddq)
        found = []
        for joint, (own, drives) in enumerate(zip(self._links, self._drives, strict=True)):
            found.append(np.zeros((len(own.felt) + len(drives), len(motion))))
            found[-1][: len(own.felt)] = links[:, joint, own.felt].T
        number = {name: i for i, name in enumerate(self.names)}
        for column in self._drive_columns(motion, {}):
            members = self.members[column.joint]
            found[column.joint][np.searchsorted(members, number[column.name])] = column.values
        return found

    def values(self) -> np.ndarray:
        """The model's values of all columns (p,), zero where it knows none."""
        known = self.model.values
        return np.nan_to_num([known[name] for name in self.names])
