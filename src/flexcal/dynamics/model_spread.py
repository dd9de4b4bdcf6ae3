"""Spread of parameters between models that recordings do not tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.estimation import Estimate


@dataclass(frozen=True, eq=False)
class ModelSpread:
    """`deviations` (models, k) of the parameters `names` from those of the selected model, which is the first of the models."""

    names: tuple[str, ...]
    deviations: np.ndarray

    @classmethod
    def of(cls, estimates: Sequence[Estimate]) -> ModelSpread:
        """Of the parameters that all `estimates` have identified, the selected model's first."""
        names = estimates[0].parameters.names
        shared = np.all([estimate.identifiable for estimate in estimates], axis=0)
        values = np.array([estimate.parameters.coordinates()[shared] for estimate in estimates])
        return cls(tuple(name for name, seen in zip(names, shared, strict=True) if seen), values - values[0])

    def widened(self, estimate: Estimate) -> Estimate:
        """The estimate, its covariance larger by the mean square of the deviations.

        With equal weights of all models that is the unconditional variance of Buckland, Burnham & Augustin (1997) about the selected one.
        """
        at = {name: i for i, name in enumerate(estimate.parameters.names) if estimate.identifiable[i]}
        shared = [k for k, name in enumerate(self.names) if name in at]
        rows = self.deviations[:, shared] / np.sqrt(len(self.deviations))
        covariance = estimate.covariance.copy()
        numbers = [at[self.names[k]] for k in shared]
        covariance[np.ix_(numbers, numbers)] += rows.T @ rows
        return replace(estimate, covariance=covariance)

    def growth(self, estimate: Estimate) -> dict[str, float]:
        """By how much each standard deviation of an estimate that is already `widened` grew, as a factor."""
        squares = np.mean(self.deviations**2, axis=0)
        found = {}
        for name, square in zip(self.names, squares, strict=True):
            std = estimate.std(name) if name in estimate.parameters else None
            if std:
                found[name] = float(1.0 / np.sqrt(max(1.0 - square / std**2, 1e-6)))
        return found
