"""The observation matrix of a robot, joint by joint: link inertials and drive terms (Eq. 2.20)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.dynamics.drive_terms import DriveTerm
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
        state = np.zeros((1, self.model.n))
        still = Motion(np.zeros(1), state, state, state, state)
        drives = [column.name for term in self.terms for column in term.columns(self.model, still)]
        return (*inertial_names(self.model), *dict.fromkeys(drives))

    @cached_property
    def members(self) -> tuple[np.ndarray, ...]:
        """For every joint the numbers of the columns that it can feel, ascending."""
        state = np.zeros((1, self.model.n))
        still = Motion(np.zeros(1), state, state, state, state)
        felt: list[set[int]] = [set() for _ in range(self.model.n)]
        for i in range(self.model.n):
            at = i
            while at >= 0:
                felt[at].update(range(len(INERTIAL) * i, len(INERTIAL) * (i + 1)))
                at = self.model.joints[at].parent
        for term in self.terms:
            for column in term.columns(self.model, still):
                felt[column.joint].add(self.names.index(column.name))
        return tuple(np.array(sorted(numbers)) for numbers in felt)

    def columns(self, motion: Motion) -> list[np.ndarray]:
        """For every joint its columns (members, N) at every sample of the motion."""
        links = torque_regressor(self.model, motion.q, motion.dq, motion.ddq)
        drives = [column for term in self.terms for column in term.columns(self.model, motion)]
        result = []
        for joint, members in enumerate(self.members):
            block = np.empty((len(members), len(motion)))
            inertial = members[members < links.shape[2]]
            block[: len(inertial)] = links[:, joint, inertial].T
            for column in drives:
                if column.joint == joint:
                    block[np.searchsorted(members, self.names.index(column.name))] = column.values
            result.append(block)
        return result

    def values(self) -> np.ndarray:
        """The model's values of all columns (p,), zero where it knows none."""
        known = self.model.values
        return np.nan_to_num([known[name] for name in self.names])
