"""Friction terms beyond viscous and Coulomb friction, on the motor axes; shapes are fixed, coefficients are identified."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Protocol, Self

import numpy as np

from flexcal.dynamics.friction.scale import ExcitationScale
from flexcal.dynamics.inverse_model import Column, Memory, MotorAxis, motor_axes
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel, unknown_parallel
from flexcal.model.torques import torque_regressor

_SHARES_OF_SPEED = (0.01, 0.03, 0.1, 0.3, 1.0)
_SHARES_OF_SPEED_LOADED = (0.3, 1.0, 3.0)
_SHARES_OF_STROKE = (0.001, 0.003, 0.01, 0.03, 0.1)
_SHARES_OF_DURATION = (0.05, 0.1, 0.2, 1 / 3)
"""Largest time constant relative to the recording: slower effects are drift and say nothing about other recordings."""


class FrictionTerm(Protocol):
    """Friction term beyond the classic ones, by its `key` in robot.yaml; its parameters are `<joint>.<key>`."""

    key: ClassVar[str]

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        """Candidate shapes of the term with their names; an empty name for a single one."""
        ...

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        """Columns as of a `DriveTerm`."""
        ...


class _PerMotor:
    """Term with one parameter per motor; a coupled joint has its share of the torque."""

    key: ClassVar[str]

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        yield "", cls()

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        raise NotImplementedError

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        for axis in motor_axes(model):
            torque = self.torque(model, motion, axis, memory)
            for joint, ratio in axis.shares:
                yield Column(f"{axis.name}.{self.key}", joint, ratio * torque)


@dataclass(frozen=True)
class AsymmetricCoulomb(_PerMotor):
    """Asymmetric Coulomb friction `<joint>.coulomb_asymmetry` · |sign ṡ|: half the difference between the directions; a torque offset
    except at rest.
    """

    key: ClassVar[str] = "coulomb_asymmetry"

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        return np.abs(np.sign(axis.of(motion.dq)))


@dataclass(frozen=True)
class SublinearViscous(_PerMotor):
    """Sublinear viscous friction `<joint>.sublinear_viscous` · sign(ṡ) √|ṡ| of shear-thinning grease."""

    key: ClassVar[str] = "sublinear_viscous"

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        speed = axis.of(motion.dq)
        return np.sign(speed) * np.sqrt(np.abs(speed))


@dataclass(frozen=True)
class Stribeck(_PerMotor):
    """Stribeck friction `<joint>.stribeck` · sign(ṡ) exp(-(ṡ/v)²), with `velocities` v of the axes, rad/s or m/s (Armstrong-Hélouvry
    1994).
    """

    velocities: tuple[float, ...]
    key: ClassVar[str] = "stribeck"

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        for share in _SHARES_OF_SPEED:
            yield f"{share:g} of the speed", cls(tuple(share * scale.speed))

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        speed = axis.of(motion.dq)
        return np.sign(speed) * np.exp(-((speed / self.velocities[axis.joint]) ** 2))


@dataclass(frozen=True)
class Presliding(_PerMotor):
    """Presliding friction `<joint>.presliding` · z, dz/ds = (1 - z sign ṡ)/δ, with `travels` δ of the axes, rad or m (Dahl 1968).

    Coulomb friction that builds up over the travel after a reversal instead of jumping; z starts at 0 with the recording.
    """

    travels: tuple[float, ...]
    key: ClassVar[str] = "presliding"

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        for share in _SHARES_OF_STROKE:
            yield f"{share:g} of the stroke", cls(tuple(share * scale.stroke))

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        position, travel = axis.of(motion.q), self.travels[axis.joint]
        key = f"{axis.name}.{self.key} {travel!r}"
        place, state = memory.get(key, (position[0], 0.0))
        states = dahl(np.append(place, position), travel, state)[1:]
        memory[key] = (position[-1], states[-1])
        return states


@dataclass(frozen=True)
class _Warming(_PerMotor):
    """Term proportional to exp(-t/τ), with t from the start of the recording and `time` τ, s."""

    time: float

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        for time in (share * scale.duration for share in _SHARES_OF_DURATION):
            yield f"{time:.3g} s", cls(time)

    def cold(self, motion: Motion, memory: Memory) -> np.ndarray:
        """Factor exp(-t/τ) (N,) at the instants of a motion."""
        begun, _ = memory.setdefault("begun", (motion.time[0], 0.0))
        return np.exp(-(motion.time - begun) / self.time)


@dataclass(frozen=True)
class WarmUp(_Warming):
    """Warm-up of viscous friction, `<joint>.warm_up` · ṡ exp(-t/τ), with t from the start of the recording and `time` τ, s."""

    key: ClassVar[str] = "warm_up"

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        return axis.of(motion.dq) * self.cold(motion, memory)


@dataclass(frozen=True)
class CoulombWarmUp(_Warming):
    """Warm-up of Coulomb friction, `<joint>.coulomb_warm_up` · sign(ṡ) exp(-t/τ), with `time` τ, s, as of `WarmUp`."""

    key: ClassVar[str] = "coulomb_warm_up"

    def torque(self, model: RobotModel, motion: Motion, axis: MotorAxis, memory: Memory) -> np.ndarray:
        return np.sign(axis.of(motion.dq)) * self.cold(motion, memory)


@dataclass(frozen=True)
class Cables:
    """Cable stiffness `<joint>.cable_stiffness` · q of cables and hoses along the arm; their rest position is part of the torque offset.

    A joint whose declared spring is identified has that in its place: the columns are the same.
    """

    key: ClassVar[str] = "cable_stiffness"

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        yield "", cls()

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        for i, name in enumerate(model.joint_names):
            if "spring_stiffness" in unknown_parallel(model, name):
                continue
            yield Column(f"{name}.{self.key}", i, motion.q[:, i])


@dataclass(frozen=True, eq=False)
class _PerLoad:
    """Term with one parameter per motor, proportional to the torque of the links on its joint.

    That is by `inertials` (10 n,) as a fit without this term found them: the measured torque would put the noise of Y into W, and the
    answer into a prediction.
    """

    inertials: np.ndarray
    key: ClassVar[str]

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        yield "", cls(scale.inertials)

    def share(self, speed: np.ndarray, axis: MotorAxis) -> np.ndarray:
        raise NotImplementedError

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        load = np.abs(torque_regressor(model, motion.q, motion.dq, motion.ddq) @ self.inertials)
        for axis in motor_axes(model):
            torque = load[:, axis.joint] * self.share(axis.of(motion.dq), axis)
            for joint, ratio in axis.shares:
                yield Column(f"{axis.name}.{self.key}", joint, ratio * torque)


@dataclass(frozen=True, eq=False)
class LoadCoulomb(_PerLoad):
    """Load-dependent Coulomb friction of the gears, `<joint>.load_coulomb` · |load| sign ṡ."""

    key: ClassVar[str] = "load_coulomb"

    def share(self, speed: np.ndarray, axis: MotorAxis) -> np.ndarray:
        return np.sign(speed)


@dataclass(frozen=True, eq=False)
class LoadStribeck(_PerLoad):
    """Load-dependent Stribeck friction `<joint>.load_stribeck` · |load| sign(ṡ) exp(-(ṡ/v)²), with `velocities` v as `Stribeck`
    (Bittencourt & Gunnarsson 2012).
    """

    velocities: tuple[float, ...]
    key: ClassVar[str] = "load_stribeck"

    @classmethod
    def shapes(cls, scale: ExcitationScale) -> Iterator[tuple[str, Self]]:
        for share in _SHARES_OF_SPEED_LOADED:
            yield f"{share:g} of the speed", cls(scale.inertials, tuple(share * scale.speed))

    def share(self, speed: np.ndarray, axis: MotorAxis) -> np.ndarray:
        return np.sign(speed) * np.exp(-((speed / self.velocities[axis.joint]) ** 2))


def dahl(position: np.ndarray, travel: float, start: float) -> np.ndarray:
    """State z (N,) of `Presliding` along `position` (N,) from z = `start`, exact for straight moves from sample to sample.

    On a stretch without reversal 1 - z sign ṡ falls by exp(-path/δ), so only the reversals are stepped through.
    """
    move = np.diff(position, prepend=position[0])
    path = np.cumsum(np.abs(move)) / travel
    moving = np.flatnonzero(move)
    turns = moving[np.flatnonzero(np.diff(np.sign(move[moving]), prepend=0.0))]
    directions, begins = np.sign(move[turns]), path[turns - 1]
    left = np.exp(-np.diff(begins))
    states = np.full(len(turns) + 1, start)
    for k, direction in enumerate(directions[:-1]):
        states[k + 1] = direction + (states[k] - direction) * left[k]
    stretch = np.searchsorted(turns, np.arange(len(position)), side="right") - 1
    before = stretch < 0
    to = np.where(before, start, np.append(directions, 0.0)[stretch])
    since = path - np.where(before, 0.0, np.append(begins, 0.0)[stretch])
    return to + (states[stretch] - to) * np.exp(-since)


LIBRARY_TERMS: tuple[type[FrictionTerm], ...] = (
    SublinearViscous,
    LoadCoulomb,
    LoadStribeck,
    Stribeck,
    Presliding,
    WarmUp,
    CoulombWarmUp,
    Cables,
)
"""Candidate terms beyond the classic ones, in the order of robot.yaml's documentation."""
