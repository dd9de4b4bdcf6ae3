"""Friction terms by their names in robot.yaml, and the shapes tried for each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.friction.stepwise import Candidate
from flexcal.dynamics.friction.terms import (
    AsymmetricCoulomb,
    Cables,
    CoulombWarmUp,
    LoadCoulomb,
    LoadStribeck,
    Presliding,
    Stribeck,
    SublinearViscous,
    WarmUp,
)
from flexcal.dynamics.inverse_model import (
    Coulomb,
    Coupling,
    DriveTerm,
    JointSprings,
    MotorAxis,
    Observation,
    RotorInertia,
    TorqueOffset,
    Viscous,
    motor_axes,
)
from flexcal.dynamics.regression import ExperimentSystem
from flexcal.errors import FlexcalError

_PLAIN: dict[str, DriveTerm] = {
    "viscous": Viscous(),
    "coulomb": Coulomb(),
    "torque_offset": TorqueOffset(),
    "asymmetric_coulomb": AsymmetricCoulomb(),
}
LIBRARY = (
    "sublinear_viscous",
    "load_coulomb",
    "load_stribeck",
    "stribeck",
    "presliding",
    "warm_up",
    "coulomb_warm_up",
    "cable_stiffness",
)
"""What is tried beyond the classic terms; an asymmetric Coulomb friction is not, as it is a torque offset."""
FRICTION_TERMS = (*_PLAIN, *LIBRARY)

_SHARES_OF_SPEED = (0.01, 0.03, 0.1, 0.3, 1.0)
_SHARES_OF_SPEED_LOADED = (0.3, 1.0, 3.0)
_SHARES_OF_STROKE = (0.001, 0.003, 0.01, 0.03, 0.1)
_SHARES_OF_DURATION = (0.05, 0.1, 0.2, 1 / 3)
"""A time constant near the length of a recording is drift by another name: it says nothing about other recordings."""


@dataclass(frozen=True, eq=False)
class Scale:
    """What shapes of terms are measured by.

    `speed` and `stroke` (n,) are those of the motor axes: the root mean square of ṡ, and its square over that of s̈; `duration` (s) is
    that of the longest recording; `inertials` (10 n,) are the links'. An axis that does not move counts as if both were 1.
    """

    speed: np.ndarray
    stroke: np.ndarray
    duration: float
    inertials: np.ndarray

    @classmethod
    def of(
        cls, systems: Sequence[ExperimentSystem], observation: Observation, inertials: np.ndarray
    ) -> Scale:
        """Of the equations of an observation with the classic terms, nothing else is needed."""
        axes = motor_axes(observation.model)
        speed, push = (
            np.array([_size(systems, observation, axis, kind) for axis in axes])
            for kind in ("viscous", "rotor_inertia")
        )
        moves = (speed > 0) & (push > 0)
        stroke = np.where(moves, speed**2, 1.0) / np.where(moves, push, 1.0)
        return cls(np.where(moves, speed, 1.0), stroke, max(s.duration for s in systems), inertials)


def _size(systems: Sequence[ExperimentSystem], observation: Observation, axis: MotorAxis, kind: str) -> float:
    """Root mean square of ṡ or s̈ of an axis: what its column of that `kind` and those of its coupling sum to at its own joint."""
    own = f"{axis.name}.{kind}"
    members = observation.members[axis.joint]
    chosen = [own, *(name for name in observation.names if name.startswith(f"{own}_at_"))]
    columns = np.searchsorted(members, [observation.names.index(name) for name in chosen])
    square = sum(
        np.sum(batch.factors[axis.joint][:, columns].sum(axis=1) ** 2) for s in systems for batch in s.batches
    )
    return math.sqrt(square / sum(batch.rows for s in systems for batch in s.batches))


def candidate_shapes(name: str, scale: Scale) -> tuple[Candidate, ...]:
    """The term `name` of the library in the shapes to try."""
    match name:
        case "sublinear_viscous":
            return (Candidate(name, "", SublinearViscous()),)
        case "load_coulomb":
            return (Candidate(name, "", LoadCoulomb(scale.inertials)),)
        case "stribeck":
            return tuple(
                Candidate(name, f"{share:g} of the speed", Stribeck(tuple(share * scale.speed)))
                for share in _SHARES_OF_SPEED
            )
        case "presliding":
            return tuple(
                Candidate(name, f"{share:g} of the stroke", Presliding(tuple(share * scale.stroke)))
                for share in _SHARES_OF_STROKE
            )
        case "load_stribeck":
            return tuple(
                Candidate(
                    name,
                    f"{share:g} of the speed",
                    LoadStribeck(scale.inertials, tuple(share * scale.speed)),
                )
                for share in _SHARES_OF_SPEED_LOADED
            )
        case "cable_stiffness":
            return (Candidate(name, "", Cables()),)
        case _:
            warming = WarmUp if name == "warm_up" else CoulombWarmUp
            times = [share * scale.duration for share in _SHARES_OF_DURATION]
            return tuple(Candidate(name, f"{time:.3g} s", warming(time)) for time in times)


def standard_terms(friction: tuple[str, ...]) -> tuple[DriveTerm, ...]:
    """Rotor inertia, the terms among `friction` outside the library, coupling and springs; raises `FlexcalError` for an unknown name."""
    for name in friction:
        if name not in FRICTION_TERMS:
            raise FlexcalError(f"there is no friction term '{name}'; there are {', '.join(FRICTION_TERMS)}.")
    return (
        RotorInertia(),
        *(_PLAIN[name] for name in _PLAIN if name in friction),
        Coupling(),
        JointSprings(),
    )
