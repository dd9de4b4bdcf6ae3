"""Feasible parameters as coordinates without bounds: log-Cholesky factors (Rucker & Wensing 2022), masses between theirs by a sigmoid."""

from collections.abc import Sequence

import numpy as np

from flexcal.estimation import Cone

LOW, HIGH = 0.79, 1.21  # a CAD mass, three times the default 7 % less and more


class LogCholesky:
    """X - floor · reference = U Uᵀ for every cone, U upper triangular with log diagonal, so that its last entry is the mass of a link."""

    def __init__(self, cones: Sequence[Cone], size: int) -> None:
        self.cones = [cone for cone in cones if np.isfinite(cone.std)]
        self.inverse = [np.linalg.pinv(c.basis.reshape(len(c.column_indices), -1).T) for c in self.cones]
        self.size = size
        self.free = np.setdiff1d(np.arange(size), np.concatenate([c.column_indices for c in self.cones]))

    def start(self) -> np.ndarray:
        """Every matrix at its reference, and nothing else."""
        own = []
        for cone in self.cones:
            factor = np.linalg.cholesky(cone.reference[::-1, ::-1])[::-1, ::-1] * np.sqrt(1 - cone.floor)
            np.fill_diagonal(factor, np.log(np.diag(factor)))
            if cone.size == 4:
                factor[3, 3] = 0.0
            own.append(factor[np.triu_indices(cone.size)])
        return np.concatenate([*own, np.zeros(len(self.free))])

    def parameters(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (p,) at the coordinates `x`, and their derivatives (p, x)."""
        values, slopes, at = np.zeros(self.size), np.zeros((self.size, len(x))), 0
        for cone, inverse in zip(self.cones, self.inverse, strict=True):
            places = np.transpose(np.triu_indices(cone.size))
            own, rate = x[at : at + len(places)].copy(), np.ones(len(places))
            diagonal = places[:, 0] == places[:, 1]
            own[diagonal] = rate[diagonal] = np.exp(own[diagonal])
            if cone.size == 4:
                share, mass = 1 / (1 + np.exp(-x[at + len(places) - 1])), cone.reference[3, 3]
                own[-1] = np.sqrt(mass * (LOW - cone.floor + (HIGH - LOW) * share))
                rate[-1] = mass * (HIGH - LOW) * share * (1 - share) / (2 * own[-1])
            factor = np.zeros((cone.size, cone.size))
            factor[tuple(places.T)] = own
            values[cone.column_indices] = inverse @ (cone.floor * cone.reference + factor @ factor.T).ravel()
            for (row, column), slope in zip(places, rate, strict=True):
                unit = np.zeros_like(factor)
                unit[row, column] = slope
                slopes[cone.column_indices, at] = inverse @ (unit @ factor.T + factor @ unit.T).ravel()
                at += 1
        values[self.free], slopes[self.free, range(at, len(x))] = x[at:], 1.0
        return values, slopes
