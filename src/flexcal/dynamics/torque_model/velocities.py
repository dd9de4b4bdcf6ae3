"""Velocities of Stribeck terms, which estimates.yaml keeps beside their coefficients."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from flexcal.dynamics.inverse_model import DriveTerm
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel

VELOCITY_TERMS = ("stribeck", "load_stribeck")


def velocity_options(terms: Iterable[DriveTerm]) -> dict[str, str]:
    """Options of an estimate's provenance with the velocities, rad/s or m/s, of those of the terms that have some."""
    return {
        f"{term.key}_velocities": " ".join(f"{velocity:.17g}" for velocity in term.velocities)  # type: ignore[attr-defined]
        for term in terms
        if getattr(term, "key", "") in VELOCITY_TERMS
    }


def stored_velocities(
    model: RobotModel, term: str, coefficients: np.ndarray, provenance: Mapping[str, str]
) -> np.ndarray:
    """Velocities (n,), rad/s or m/s, of a term with these `coefficients` (n,); ones where all coefficients are zero.

    Raises `InputError` where the coefficients have no velocities beside them.
    """
    if not coefficients.any():
        return np.ones(model.n)
    words = provenance.get(f"option.{term}_velocities", "").split()
    if len(words) != model.n:
        raise InputError(
            "E-DYN-047",
            f"the estimates of {model.path} have {term} friction without its velocities; run 'flexcal identify dynamics' again.",
        )
    return np.array([float(word) for word in words])
