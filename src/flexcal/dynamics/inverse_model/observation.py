"""Observation matrix of a robot, joint by joint: link inertials and drive terms, rigid (Eq. 2.20) or flexible (Eq. 2.22)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.dynamics.inverse_model.bearing_spring import BearingSpring
from flexcal.dynamics.inverse_model.drive_spring import DriveSpring, coupled_columns
from flexcal.dynamics.inverse_model.drive_terms import Column, DriveTerm, JointSprings, Memory
from flexcal.dynamics.inverse_model.independent_inertials import InertialColumns, inertial_columns
from flexcal.dynamics.inverse_model.sensor_offset import SensorOffset
from flexcal.dynamics.inverse_model.tilted_bearings import TiltedBearings
from flexcal.dynamics.signals import ArmSide, Motion
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_names, torque_regressor, write_torque_regressor


@dataclass(frozen=True, eq=False)
class Observation:
    """Columns of the joint torques: link inertials and drive terms of a robot.

    There is one equation a joint, and after them one a motor that is connected by one of the `springs`: that of the motor alone. The
    joint's own is arm and motor together, Eq. 2.22's two rows added: the spring cancels, links move with the arm, drives with the motor,
    and what acts from outside (τ_ext) stands beside the motor's torque. After them comes one a bearing spring, where tilts were measured:
    that of the links about the tilt's axis, whose right-hand side is zero.

    Of the columns of a joint that the links bring, some always are combinations of others, whatever the motion is. `reduced` leaves them
    out, and `projection` (one an equation) says how the others give them back: W = W_reduced · projection.
    """

    model: RobotModel
    terms: tuple[DriveTerm, ...]
    springs: tuple[DriveSpring, ...] = ()
    bearings: tuple[BearingSpring, ...] = ()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all columns: the links' inertials in chain order, then the terms'."""
        drives = [column.name for column in self._at_rest]
        return (*inertial_names(self.model), *dict.fromkeys(drives))

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the joints, then of motors alone, then of bearings."""
        bearings = (bearing.name(self.model) for bearing in self.bearings)
        return (*self.model.joint_names, *(f"{motor}, motor" for motor in self.motors), *bearings)

    @property
    def undriven(self) -> range:
        """Numbers of the equations whose right-hand side is zero: those of the bearings."""
        first = self.model.n + len(self.springs)
        return range(first, first + len(self.bearings))

    @property
    def motors(self) -> tuple[str, ...]:
        """Joints whose motors have equations of their own, in the order of these."""
        return tuple(self.model.joint_names[spring.joint] for spring in self.springs)

    @cached_property
    def _torques(self) -> list[int]:
        """Joint of each equation whose motor torque is its right-hand side."""
        return [*range(self.model.n), *(spring.joint for spring in self.springs)]

    @cached_property
    def column_indices(self) -> tuple[np.ndarray, ...]:
        """Numbers of the columns of each equation that can be nonzero, ascending."""
        return tuple(
            np.concatenate([links.felt, own]) for links, own in zip(self._links, self._drives, strict=True)
        )

    @cached_property
    def projection(self) -> tuple[np.ndarray, ...]:
        """Matrix (reduced, columns) of each equation from its reduced columns."""
        projections = []
        for links, own in zip(self._links, self._drives, strict=True):
            kept, felt = links.projection.shape
            projection = np.eye(kept + len(own), felt + len(own), k=felt - kept)
            projection[:kept, :felt] = links.projection
            projections.append(projection)
        return tuple(projections)

    @cached_property
    def _links(self) -> tuple[InertialColumns, ...]:
        """Columns of the links of each equation; none for a motor alone, all with tilting bearings."""
        nothing = InertialColumns(np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros((0, 0)))
        motors = (nothing for _ in self.springs)
        if self._tilted is None:
            return (*inertial_columns(self.model), *motors)
        joints = [(joint, 2) for joint in range(self.model.n)]
        tilts = [(bearing.joint, bearing.component) for bearing in self.bearings]
        every = [[_all_of(self._tilted.felt(at)) for at in some] for some in (joints, tilts)]
        return (*every[0], *motors, *every[1])

    @cached_property
    def _tilted(self) -> TiltedBearings | None:
        """Arm with tilting bearings, if any."""
        tilting = sorted({bearing.joint for bearing in self.bearings})
        return TiltedBearings(self.model, tilting) if tilting else None

    @cached_property
    def _at_rest(self) -> list[Column]:
        state = np.zeros((1, self.model.n))
        side = ArmSide(state, state, state)
        still = Motion(np.zeros(1), state, state, state, state, replace(side, tilts=(side, side)))
        return list(self._drive_columns(still, {}))

    @cached_property
    def _drives(self) -> list[np.ndarray]:
        """Numbers of the nonzero drive columns of each equation, ascending."""
        number = {name: i for i, name in enumerate(self.names)}
        felt: list[set[int]] = [set() for _ in self.labels]
        for column in self._at_rest:
            felt[column.joint].add(number[column.name])
        return [np.array(sorted(numbers), dtype=int) for numbers in felt]

    @cached_property
    def widths(self) -> list[int]:
        """Number of reduced columns of each equation, and one for its torque."""
        return [len(matrix) + 1 for matrix in self.projection]

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Row numbers in `reduced` of the links' entries (coordinates, 10 n), -1 for those left out, and of every drive column.

        Coordinates are the joints, or those of the tilted arm.
        """
        starts = np.cumsum([0, *self.widths])
        tilts = {
            (bearing.joint, bearing.component): at
            for bearing, at in zip(self.bearings, self.undriven, strict=True)
        }
        coordinates = [(joint, 2) for joint in range(self.model.n)]
        coordinates = coordinates if self._tilted is None else self._tilted.coordinates
        links = np.full((len(coordinates), len(LINK_PARAMETERS) * self.model.n), -1)
        for number, (joint, component) in enumerate(coordinates):
            equation = joint if component == 2 else tilts[joint, component]
            own = self._links[equation]
            links[number, own.kept] = starts[equation] + np.arange(len(own.kept))
        number = {name: i for i, name in enumerate(self.names)}
        drives = [
            starts[c.joint]
            + len(self._links[c.joint].kept)
            + np.searchsorted(self._drives[c.joint], number[c.name])
            for c in self._at_rest
        ]
        return links, np.array(drives, dtype=int)

    def reduced(self, motion: Motion, memory: Memory | None = None) -> np.ndarray:
        """Reduced columns and, last, torque of each equation, below each other (Σ widths, N), at every sample of the motion.

        The torque is the logged one times the drive gains of the model, 1 where none was estimated.

        The motion continues what `memory` is of, which is brought up to its end; it begins an experiment without. Raises `FlexcalError`
        where there are springs and the motion has no arm side.
        """
        links, drives = self._places
        rows = np.empty((sum(self.widths), len(motion)))
        if self._tilted is None:
            write_torque_regressor(self.model, *self._link_states(motion), links, rows)
        else:
            self._tilted.write(self._link_states(motion), motion, links, rows)
        undriven = np.zeros((len(motion), len(self.bearings)))
        torque = motion.torque * self.model.drives.drive_gain
        right = [motion.net - motion.torque + torque, torque[:, self._torques[self.model.n :]], undriven]
        rows[np.cumsum(self.widths) - 1] = np.hstack(right).T
        columns = self._drive_columns(motion, {} if memory is None else memory)
        for place, column in zip(drives, columns, strict=True):
            rows[place] = column.values
        return rows

    def systems(self, motion: Motion, memory: Memory | None = None) -> list[np.ndarray]:
        """All columns of each equation and, last, its torque (columns + 1, N), where `reduced` leaves some out."""
        parts = np.split(self.reduced(motion, memory), np.cumsum(self.widths)[:-1])
        return [
            np.vstack([s.T @ part[:-1], part[-1]]) for s, part in zip(self.projection, parts, strict=True)
        ]

    def follow(self, motion: Motion, memory: Memory) -> None:
        """Advance `memory` to the end of a motion whose columns are not needed."""
        for _ in self._drive_columns(motion, memory):
            pass

    def _drive_columns(self, motion: Motion, memory: Memory) -> Iterator[Column]:
        motors = {spring.joint: self.model.n + k for k, spring in enumerate(self.springs)}
        behind = replace(motion, q=self._link_states(motion)[0])
        for term in self.terms:
            on_arm = isinstance(term, JointSprings | SensorOffset)
            for column in term.columns(self.model, behind if on_arm else motion, memory):
                yield column
                if column.joint in motors and not on_arm:
                    yield Column(column.name, motors[column.joint], column.values)
        for spring in self.springs:
            yield from spring.columns(self.model, motion, motors[spring.joint])
        yield from coupled_columns(self.model, motion, motors)
        for bearing, equation in zip(self.bearings, self.undriven, strict=True):
            yield from bearing.columns(self.model, motion, equation)

    def _link_states(self, motion: Motion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations of the links: after elastic drives, else those of the motors."""
        states = motion.q, motion.dq, motion.ddq
        if motion.arm is None or not self.springs:
            return states
        behind = np.isin(np.arange(self.model.n), [spring.joint for spring in self.springs])
        arm = motion.arm.q, motion.arm.dq, motion.arm.ddq
        q, dq, ddq = (np.where(behind, far, near) for far, near in zip(arm, states, strict=True))
        return q, dq, ddq

    def columns(self, motion: Motion) -> list[np.ndarray]:
        """All columns of each equation (columns, N) at every sample of the motion."""
        if self._tilted is not None:
            return [system[:-1] for system in self.systems(motion)]
        links = torque_regressor(self.model, *self._link_states(motion))
        values = [np.zeros((len(own), len(motion))) for own in self.column_indices]
        for joint, own in enumerate(self._links[: self.model.n]):
            values[joint][: len(own.felt)] = links[:, joint, own.felt].T
        number = {name: i for i, name in enumerate(self.names)}
        for column in self._drive_columns(motion, {}):
            own = self.column_indices[column.joint]
            values[column.joint][np.searchsorted(own, number[column.name])] = column.values
        return values

    def values(self) -> np.ndarray:
        """Model values of all columns (p,), zero if unknown."""
        known = self.model.values
        return np.nan_to_num([known.get(name, 0.0) for name in self.names])


def _all_of(felt: np.ndarray) -> InertialColumns:
    """Trivial reduction that keeps all nonzero columns."""
    return InertialColumns(felt, felt, np.eye(len(felt)))
