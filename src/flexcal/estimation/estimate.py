"""The result of every identification."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from flexcal.estimation.misfit import Misfit
from flexcal.estimation.parameter import Parameters
from flexcal.estimation.student_t import student_quantile

NORMAL_QUANTILE = 1.959963984540054

_NOISE_UNKNOWN = 0.1
"""What chi2 may exceed its expectation by, relative, because the noise level is hardly better known."""


@dataclass(frozen=True)
class Dropped:
    """A parameter that is not identifiable: it keeps its start value and is absorbed by the kept ones.

    A kept parameter with (name, coefficient) in `absorbed_by` estimates kept + coefficient · (dropped − its start value),
    all in estimation coordinates. Nothing in `absorbed_by`: the data do not depend on it.
    """

    name: str
    absorbed_by: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated parameters with their joint uncertainty.

    `parameters` carry the estimates as values; `covariance` (p, p) is in estimation coordinates, with zero rows and columns
    for `dropped` parameters: given their fixed values, predictions inside the model's reach have exactly this uncertainty.
    `identifiable` is False for dropped parameters, and for parameters on a log scale with a standard deviation above 0.255
    (not known to a factor of two). `cost` is the minimised objective, prior included. `chi2` is the data's
    whitened residual sum of squares, prior rows excluded and with robust weights where a robust loss is used;
    `degrees_of_freedom` its expectation, the (weighted) number of rows less the effective number of parameters, rounded.
    `outliers` are labels of groups, or row numbers where the problem has no groups. `covariance_freedom` are the degrees of freedom of a
    covariance that the scatter of few batches gave; without it the noise level's stand for them. `misfit` says where a fit to frequency
    responses does not explain them. `ranges` are those of the conditions, by name, that the data cover: the estimate says little outside
    them. `measurements` are digests of those that a calibration was fitted to.
    """

    parameters: Parameters
    covariance: np.ndarray
    rank: int
    dropped: tuple[Dropped, ...]
    identifiable: tuple[bool, ...]
    cost: float
    chi2: float
    degrees_of_freedom: int
    status: str
    message: str
    iterations: int
    outliers: tuple[int, ...] = ()
    covariance_freedom: float | None = None
    misfit: Misfit | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    measurements: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Estimates in natural units, by name."""
        return {item.name: item.value for item in self.parameters}

    @property
    def reduced_chi2(self) -> float:
        """chi2 / degrees of freedom: near one when model and noise are right; NaN without degrees of freedom."""
        return self.chi2 / self.degrees_of_freedom if self.degrees_of_freedom > 0 else math.nan

    @property
    def unexplained(self) -> bool:
        """Whether chi2 is more than noise explains: chance, three standard deviations of its distribution, and 10 % for noise that is
        itself known to 5 %."""
        if self.degrees_of_freedom <= 0:
            return False
        return self.reduced_chi2 > 1.0 + max(_NOISE_UNKNOWN, 3.0 * math.sqrt(2.0 / self.degrees_of_freedom))

    @property
    def converged(self) -> bool:
        return self.status == "converged"

    def std(self, name: str) -> float | None:
        """Standard deviation in natural units, to first order; None when not identifiable."""
        number = self.parameters.index(name)
        if not self.identifiable[number]:
            return None
        slope = self.parameters.natural_slope(self.parameters.coordinates())[number]
        return float(slope * math.sqrt(self.covariance[number, number]))

    def interval(self, name: str) -> tuple[float, float] | None:
        """95 % interval (low, high) in natural units, symmetric in the estimation coordinate; None when not identifiable.

        Quantile of Student's t below 100 degrees of freedom, where the noise level or the covariance is hardly better known, else normal.
        """
        number = self.parameters.index(name)
        if not self.identifiable[number]:
            return None
        item = self.parameters[number]
        centre = item.coordinate(item.value)
        half = self._quantile() * math.sqrt(self.covariance[number, number])
        return item.natural(centre - half), item.natural(centre + half)

    def quantity(self, name: str, truth: float | None = None) -> dict[str, float | bool | None]:
        """The quantity as every results file has it; std, low and high are None when not identifiable."""
        interval = self.interval(name)
        return {
            "estimate": float(self.parameters[name].value),
            "std": self.std(name),
            "low": interval[0] if interval else None,
            "high": interval[1] if interval else None,
            "truth": None if truth is None else float(truth),
            "identifiable": self.identifiable[self.parameters.index(name)],
        }

    def marginal(self, names: Iterable[str]) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (k,) and covariance (k, k) of the named parameters, both in estimation coordinates."""
        numbers = [self.parameters.index(name) for name in names]
        return self.parameters.coordinates()[numbers], self.covariance[np.ix_(numbers, numbers)]

    def regrouped(self, truth: Mapping[str, float]) -> dict[str, float]:
        """What this estimate should have found for `truth` (natural units): dropped parameters mapped into the kept ones.

        Names that `truth` lacks are taken at the estimate. Dropped parameters come back at the value they were held at.
        """
        start = self.parameters.coordinates()
        known = {name: value for name, value in truth.items() if name in self.parameters}
        x = self.parameters.coordinates(known)
        for dropped in self.dropped:
            number = self.parameters.index(dropped.name)
            for kept, coefficient in dropped.absorbed_by:
                x[self.parameters.index(kept)] += coefficient * (x[number] - start[number])
            x[number] = start[number]
        return dict(zip(self.parameters.names, (float(v) for v in self.parameters.natural(x)), strict=True))

    def _quantile(self) -> float:
        freedom = self.degrees_of_freedom if self.covariance_freedom is None else self.covariance_freedom
        if not 0 < freedom < 100:
            return NORMAL_QUANTILE
        return student_quantile(0.975, freedom)
