"""The observation matrix of a robot, joint by joint: link inertials and drive terms, rigid (Eq. 2.20) or flexible (Eq. 2.22)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.dynamics.arm_side import ArmSide
from flexcal.dynamics.drive_spring import DriveSpring
from flexcal.dynamics.drive_terms import Column, DriveTerm, Memory
from flexcal.dynamics.motion import Motion
from flexcal.model import RobotModel, inertial_names, torque_regressor
from flexcal.model.regressor import INERTIAL


@dataclass(frozen=True, eq=False)
class Observation:
    """Which parameters the torques depend on, and how.

    There is one equation a joint, and after them one a motor that is connected by one of the `springs`: that of the motor alone. The
    joint's own is arm and motor together, Eq. 2.22's two rows added: the spring cancels, links move with the arm, drives with the motor.
    """

    model: RobotModel
    terms: tuple[DriveTerm, ...]
    springs: tuple[DriveSpring, ...] = ()

    @cached_property
    def equations(self) -> tuple[str, ...]:
        """What each equation is of: the joints' names, then those of the motors alone."""
        joints = self.model.joint_names
        return (*joints, *(f"{joints[spring.joint]}, motor" for spring in self.springs))

    @cached_property
    def _torques(self) -> list[int]:
        """For every equation the joint whose motor torque is its right side."""
        return [*range(self.model.n), *(spring.joint for spring in self.springs)]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all columns: the links' inertials in chain order, then the terms'."""
        drives = [column.name for column in self._at_rest]
        return (*inertial_names(self.model), *dict.fromkeys(drives))

    @cached_property
    def members(self) -> tuple[np.ndarray, ...]:
        """For every equation the numbers of the columns that it can feel, ascending."""
        felt: list[set[int]] = [set() for _ in self.equations]
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
        still = Motion(np.zeros(1), state, state, state, state, ArmSide(state, state, state))
        return list(self._drive_columns(still, {}))

    @cached_property
    def _links(self) -> list[slice | np.ndarray]:
        """For every joint which inertial columns it can feel."""
        found: list[slice | np.ndarray] = []
        for members in self.members[: self.model.n]:
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
        """For every equation the number of its columns, and one for its torque."""
        return [len(members) + 1 for members in self.members]

    def systems(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """For every equation its columns and, last, its torque, below each other (Σ widths, N), at every sample of the motion.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without. Raises `FlexcalError`
        where there are springs and the motion has no arm side.
        """
        links = torque_regressor(self.model, *self._link_states(motion)).transpose(1, 2, 0)
        found = np.empty((sum(self.widths), len(motion)))
        starts = np.cumsum([0, *self.widths])
        for joint, (felt, start) in enumerate(zip(self._links, starts, strict=False)):
            part = links[joint, felt]
            found[start : start + len(part)] = part
        found[starts[1:] - 1] = motion.torque[:, self._torques].T
        values = (column.values for column in self._drive_columns(motion, {} if memory is None else memory))
        for place, column in zip(self._drives, values, strict=True):
            found[place] = column
        return found

    def follow(self, motion: Motion, memory: Memory) -> None:
        """Bring `memory` up to the end of a motion whose columns are not needed."""
        for _ in self._drive_columns(motion, memory):
            pass

    def _drive_columns(self, motion: Motion, memory: Memory) -> Iterator[Column]:
        motors = {spring.joint: self.model.n + k for k, spring in enumerate(self.springs)}
        for term in self.terms:
            for column in term.columns(self.model, motion, memory):
                yield column
                if column.joint in motors:
                    yield Column(column.name, motors[column.joint], column.values)
        for spring in self.springs:
            yield from spring.columns(self.model, motion, motors[spring.joint])

    def _link_states(self, motion: Motion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations of the links: behind the springs, else as the motors."""
        states = motion.q, motion.dq, motion.ddq
        if motion.arm is None or not self.springs:
            return states
        behind = np.isin(np.arange(self.model.n), [spring.joint for spring in self.springs])
        arm = motion.arm.q, motion.arm.dq, motion.arm.ddq
        q, dq, ddq = (np.where(behind, far, near) for far, near in zip(arm, states, strict=True))
        return q, dq, ddq

    def columns(self, motion: Motion) -> list[np.ndarray]:
        """For every equation its columns (members, N) at every sample of the motion."""
        systems = np.split(self.systems(motion), np.cumsum(self.widths)[:-1])
        return [system[:-1] for system in systems]

    def values(self) -> np.ndarray:
        """The model's values of all columns (p,), zero where it knows none."""
        known = self.model.values
        return np.nan_to_num([known.get(name, 0.0) for name in self.names])
