"""Joint covariance of a robot's estimated values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.estimation import Estimate, Parameters


@dataclass(frozen=True, eq=False)
class Posterior:
    """Estimated `parameters` and their joint `covariance` (p, p) in estimation coordinates."""

    parameters: Parameters
    covariance: np.ndarray

    def determines(self, name: str) -> bool:
        """Whether a parameter was estimated rather than held fixed as not separable from others."""
        if name not in self.parameters:
            return False
        number = self.parameters.index(name)
        return bool(self.covariance[number, number] > 0)

    def marginal(self, names: Sequence[str]) -> np.ndarray:
        """Joint covariance (k, k) of the named parameters, in estimation coordinates."""
        numbers = [self.parameters.index(name) for name in names]
        return self.covariance[np.ix_(numbers, numbers)]

    def prior(self, declared: Parameters) -> tuple[Parameters, np.ndarray]:
        """Prior for a further identification of `declared`: these values with their marginal priors, and the joint prior covariance (p,
        p).

        Where they were estimated before, on the same scale, the joint covariance of that replaces what was declared of them. Values stay:
        a robot with this posterior has its values.
        """
        known = [
            k
            for k, item in enumerate(declared)
            if self.determines(item.name) and self.parameters[item.name].scale == item.scale
        ]
        covariance = np.diag(declared.prior_std() ** 2)
        covariance[np.ix_(known, known)] = self.marginal([declared.names[k] for k in known])
        std = np.sqrt(np.diag(covariance))
        items = (replace(item, prior_std=float(s)) for item, s in zip(declared, std, strict=True))
        return Parameters(items), covariance

    def updated(self, estimate: Estimate, names: tuple[str, ...]) -> Posterior:
        """Posterior with the named parameters taken from `estimate`; the remaining ones are kept and taken as independent of it."""
        newer = estimate.parameters.subset(names)
        older = [name for name in self.parameters.names if name not in newer]
        size = len(older)
        covariance = np.zeros((size + len(newer), size + len(newer)))
        covariance[:size, :size] = self.marginal(older)
        covariance[size:, size:] = estimate.marginal(names)[1]
        return Posterior(self.parameters.subset(older) + newer, covariance)


NOTHING_ESTIMATED = Posterior(Parameters(), np.zeros((0, 0)))
