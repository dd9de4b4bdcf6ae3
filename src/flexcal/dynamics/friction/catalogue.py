"""Friction terms by their names in robot.yaml, and the shapes tried for each."""

from __future__ import annotations

from flexcal.dynamics.friction.scale import ExcitationScale
from flexcal.dynamics.friction.stepwise import Candidate
from flexcal.dynamics.friction.terms import LIBRARY_TERMS, AsymmetricCoulomb
from flexcal.dynamics.inverse_model import (
    Coulomb,
    Coupling,
    DriveTerm,
    JointSprings,
    RotorInertia,
    TorqueOffset,
    Viscous,
)
from flexcal.errors import FlexcalError

_PLAIN: dict[str, DriveTerm] = {
    "viscous": Viscous(),
    "coulomb": Coulomb(),
    "torque_offset": TorqueOffset(),
    "asymmetric_coulomb": AsymmetricCoulomb(),
}
_LIBRARY = {term.key: term for term in LIBRARY_TERMS}
LIBRARY = tuple(_LIBRARY)
"""Candidate terms beyond the classic ones; without asymmetric Coulomb friction, which is a torque offset."""
FRICTION_TERMS = (*_PLAIN, *LIBRARY)


def candidate_shapes(name: str, scale: ExcitationScale) -> tuple[Candidate, ...]:
    """Library term `name` in its candidate shapes."""
    return tuple(Candidate(name, shape, term) for shape, term in _LIBRARY[name].shapes(scale))


def standard_terms(friction: tuple[str, ...]) -> tuple[DriveTerm, ...]:
    """Rotor inertia, the terms among `friction` outside the library, coupling and springs; raises `FlexcalError` for an unknown name."""
    for name in friction:
        if name not in FRICTION_TERMS:
            raise FlexcalError(
                "E-DYN-013", f"there is no friction term '{name}'; there are {', '.join(FRICTION_TERMS)}."
            )
    return (
        RotorInertia(),
        *(_PLAIN[name] for name in _PLAIN if name in friction),
        Coupling(),
        JointSprings(),
    )
