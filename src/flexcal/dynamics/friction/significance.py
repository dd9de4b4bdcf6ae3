"""Significance of friction terms under autocorrelated noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData
from flexcal.estimation import Estimate

_FREEDOM = 8.0
"""Least degrees of freedom of a significance test."""


@dataclass(frozen=True, eq=False)
class CandidateFit:
    """Weighted least squares of selected columns of an observation with the columns of all candidates.

    `plain` are the numbers of the columns that are always in.
    """

    observation: Observation
    systems: Sequence[ExperimentSystem]
    plain: Sequence[int]

    def estimate(self, further: Sequence[int]) -> Estimate:
        """Estimate with the plain columns and `further` ones, by their numbers; raises `FlexcalError` as `weighted_least_squares` does."""
        kept = tuple(sorted({*self.plain, *further}))
        names = self.observation.names
        regrouping = np.zeros((len(kept), len(names)))
        regrouping[range(len(kept)), kept] = 1.0
        base = replace(
            BaseParameters.of(replace(self.observation, terms=())).identifiability,
            names=names,
            rank=len(kept),
            kept=kept,
            regrouping=regrouping,
        )
        return weighted_least_squares(RegressionData.of(self.observation, BaseParameters(base), self.systems))

    def p_value(self, before: Sequence[int], group: Sequence[int]) -> float:
        """p-value of a `group` of columns added to those `before`.

        That of the largest ratio of a parameter to its standard deviation, by Student's t with the degrees of freedom of the covariance,
        times the number of parameters (Bonferroni). The covariance allows for noise with a memory; a term that acts at one joint counts.
        At least eight degrees of freedom are taken: torques that a model with too few terms misses pass for noise with a long memory.
        """
        from scipy.special import stdtr

        estimate = self.estimate([*before, *group])
        ratios = [
            abs(estimate.parameters[number].value) / np.sqrt(estimate.covariance[number, number])
            for number in group
            if estimate.identifiable[number]
        ]
        if not ratios:
            return 1.0
        freedom = max(_FREEDOM, estimate.covariance_freedom or _FREEDOM)
        return float(min(1.0, 2.0 * len(ratios) * stdtr(freedom, -max(ratios))))
