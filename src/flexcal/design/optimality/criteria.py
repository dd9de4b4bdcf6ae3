"""Optimality criteria of sets of measurements: D, A, c, E, and the observability indices O1-O5.

Every criterion has a `merit`, larger is better, of the information matrix M = ΘᵀΘ (p, p), and its derivative by M. The indices are those
of Sun & Hollerbach, "Observability index selection for robot calibration" (2008), with σ the singular values of Θ in declared units:
O1 geometric mean / √poses (Borm & Menq), O2 σ_min/σ_max (Driels & Pathre), O3 σ_min (Nahvi), O4 σ_min²/σ_max (Nahvi & Hollerbach),
O5 1/Σ 1/σ (Sun & Hollerbach). O1 ranks sets like D, O3 like E; E here is σ_min of ΘᵀΘ, the square of O3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation import Sensitivity


class Criterion(Protocol):
    """Criterion that the exchange algorithm maximises."""

    @property
    def name(self) -> str:
        """Name in reports."""
        ...

    @property
    def uses_prior(self) -> bool:
        """Whether the prior information counts; the classical indices assess the measurements alone."""
        ...

    def merit(self, information: np.ndarray) -> float:
        """Merit of M (p, p); -inf or 0 where M is singular."""
        ...

    def gradient(self, information: np.ndarray) -> np.ndarray:
        """Derivative (p, p), symmetric, of the merit by M: a set grows by tr(gradient · ΘᵢᵀΘᵢ) per weight of candidate i."""
        ...


@dataclass(frozen=True)
class DOptimal:
    """D-optimality log det M / p: the volume of the confidence ellipsoid, independent of units and basis."""

    name: str = "D"
    uses_prior: bool = True

    def merit(self, information: np.ndarray) -> float:
        sign, value = np.linalg.slogdet(information)
        return float(value) / len(information) if sign > 0 else -np.inf

    def gradient(self, information: np.ndarray) -> np.ndarray:
        return _inverse(information) / len(information)


@dataclass(frozen=True, eq=False)
class TraceOptimal:
    """Trace criterion -½ log tr(W M⁻¹): A-optimal for W = 1, c-optimal for W = JᵀJ of the predicted quantities J (m).

    `trace` itself is the summed variance of these quantities.
    """

    weight: np.ndarray
    name: str
    uses_prior: bool = True

    def trace(self, information: np.ndarray) -> float:
        """tr(W M⁻¹); inf where M is not positive."""
        try:
            factor = np.linalg.cholesky(information)
        except np.linalg.LinAlgError:
            return np.inf
        half = np.linalg.solve(factor, self.weight)
        return float(np.trace(np.linalg.solve(factor, half.T)))

    def merit(self, information: np.ndarray) -> float:
        return -0.5 * float(np.log(self.trace(information)))

    def gradient(self, information: np.ndarray) -> np.ndarray:
        inverse = _inverse(information)
        weighted = inverse @ self.weight @ inverse
        return weighted / (2 * np.trace(inverse @ self.weight))


@dataclass(frozen=True)
class SpectralCriterion:
    """Criterion of the eigenvalues of M alone; `name` is E, O1, O2, O3, O4 or O5. All but E are in singular values of Θ."""

    name: str
    uses_prior: bool = False

    def __post_init__(self) -> None:
        if self.name not in SPECTRAL_NAMES:
            raise FlexcalError(
                "E-DESIGN-012",
                f"there is no spectral criterion '{self.name}'; there are {', '.join(SPECTRAL_NAMES)}.",
            )

    def of_eigenvalues(self, eigenvalues: np.ndarray) -> np.ndarray:
        """Merit (...) of eigenvalues (..., p) in any order."""
        values = np.maximum(eigenvalues, np.finfo(float).tiny)
        match self.name:
            case "O1":
                return np.exp(0.5 * np.mean(np.log(values), axis=-1))
            case "O2":
                return np.sqrt(values.min(axis=-1) / values.max(axis=-1))
            case "O3":
                return np.sqrt(values.min(axis=-1))
            case "O4":
                return values.min(axis=-1) / np.sqrt(values.max(axis=-1))
            case "O5":
                return 1 / np.sum(values**-0.5, axis=-1)
            case _:
                return values.min(axis=-1)

    def merit(self, information: np.ndarray) -> float:
        return float(self.of_eigenvalues(np.linalg.eigvalsh(information)))

    def gradient(self, information: np.ndarray) -> np.ndarray:
        """As in `Criterion`; where the least eigenvalue is a multiple one, the derivative along one of its eigenvectors."""
        values, vectors = np.linalg.eigh(information)
        return (vectors * self._slopes(values)) @ vectors.T

    def _slopes(self, values: np.ndarray) -> np.ndarray:
        """d merit / d eigenvalue (p,) at ascending eigenvalues (p,)."""
        slopes = np.zeros(len(values))
        least, most = values[0], values[-1]
        merit = self.of_eigenvalues(values)
        match self.name:
            case "O1":
                slopes = merit / (2 * len(values) * values)
            case "O2":
                slopes[0], slopes[-1] = 0.5 * merit / least, -0.5 * merit / most
            case "O3":
                slopes[0] = 0.5 / merit
            case "O4":
                slopes[0], slopes[-1] = most**-0.5, -0.5 * merit / most
            case "O5":
                slopes = 0.5 * merit**2 * values**-1.5
            case _:
                slopes[0] = 1.0
        return slopes


SPECTRAL_NAMES = ("E", "O1", "O2", "O3", "O4", "O5")


@dataclass(frozen=True)
class Observability:
    """The five indices of a set of measurements; `o1` is divided by √poses."""

    o1: float
    o2: float
    o3: float
    o4: float
    o5: float

    @property
    def sigma_min(self) -> float:
        """E criterion: least eigenvalue of ΘᵀΘ."""
        return self.o3**2


def observability(
    sensitivity: Sensitivity, chosen: Sequence[int] | np.ndarray | None = None
) -> Observability:
    """O1-O5 of the chosen candidates (all by default), without the prior; in the units of the sensitivity's columns."""
    rows = sensitivity.jacobian if chosen is None else sensitivity.jacobian[np.asarray(chosen, dtype=int)]
    stacked = rows.reshape(-1, rows.shape[2])
    if len(stacked) < stacked.shape[1]:
        raise FlexcalError(
            "E-DESIGN-013",
            f"{len(rows)} poses give {len(stacked)} rows, too few for {stacked.shape[1]} parameters; choose more poses.",
        )
    squares = np.linalg.svd(stacked, compute_uv=False) ** 2
    value = {name: float(SpectralCriterion(name).of_eigenvalues(squares)) for name in SPECTRAL_NAMES}
    return Observability(value["O1"] / len(rows) ** 0.5, value["O2"], value["O3"], value["O4"], value["O5"])


def _inverse(information: np.ndarray) -> np.ndarray:
    """Inverse of a positive definite matrix by its Cholesky factor; raises `FlexcalError` if there is none."""
    try:
        factor = np.linalg.cholesky(information)
    except np.linalg.LinAlgError as problem:
        raise FlexcalError(
            "E-DESIGN-014",
            "the measurements leave a combination of parameters undetermined; choose more of them or give a prior.",
        ) from problem
    root = np.linalg.solve(factor, np.eye(len(information)))
    return root.T @ root
