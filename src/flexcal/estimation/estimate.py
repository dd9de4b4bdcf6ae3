"""Result of an identification."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from flexcal.estimation.misfit import Misfit
from flexcal.estimation.parameter import Parameters
from flexcal.estimation.student_t import student_quantile

NORMAL_QUANTILE = 1.959963984540054

_TAKEN_UP = 1e-9
"""Coefficient below which a kept parameter has taken up nothing of a dropped one."""
_NOISE_UNKNOWN = 0.1
"""Relative excess of chi2 over its expectation that is tolerated, because the noise level is hardly better known."""


@dataclass(frozen=True)
class Dropped:
    """Parameter that is not identifiable: it keeps its start value and is absorbed by the kept ones.

    A kept parameter with (name, coefficient) in `absorbed_by` estimates kept + coefficient · (dropped − its start value),
    all in estimation coordinates. Nothing in `absorbed_by`: the data do not depend on it.
    """

    name: str
    absorbed_by: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated parameters with their joint uncertainty.

    Attributes
    ----------
    parameters : Parameters
        Names, units and estimated values.
    covariance : ndarray
        Covariance (p, p) in estimation coordinates, with zero rows and columns for `dropped` parameters: given their fixed values,
        predictions inside the model's reach have exactly this uncertainty.
    rank : int
        Number of parameters that the data determine.
    dropped : tuple of Dropped
        Parameters that the data do not determine, held at fixed values.
    identifiable : tuple of bool
        False for dropped parameters, and for parameters on a log scale with a standard deviation above 0.255 (not known to a factor
        of 1.65 at 95 %).
    cost : float
        Minimised objective, prior included.
    chi2 : float
        Whitened residual sum of squares of the data, without prior rows and with robust weights where a robust loss is used.
    degrees_of_freedom : int
        Expectation of `chi2`: the (weighted) number of rows less the effective number of parameters, rounded.
    status, message : str
        Whether and why the minimisation ended.
    iterations : int
        Number of iterations.
    outliers : tuple of int
        Labels of groups, or row numbers where the problem has no groups.
    covariance_freedom : float or None
        Degrees of freedom of a covariance that was estimated from few batches; without it, those of the noise level count.
    misfit : Misfit or None
        Where a fit does not explain frequency responses.
    provenance : mapping of str
        Digests of the files that the estimate was made from.
    ranges : mapping of tuple
        Ranges of the conditions, by name, that the data cover: the estimate says little outside them.
    measurements : tuple of str
        Digests of the measurements that a calibration was fitted to.
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

    @cached_property
    def values(self) -> dict[str, float]:
        """Estimates in natural units, by name."""
        return {item.name: item.value for item in self.parameters}

    @property
    def reduced_chi2(self) -> float:
        """chi2 / degrees of freedom: near one when model and noise are right; NaN without degrees of freedom."""
        return self.chi2 / self.degrees_of_freedom if self.degrees_of_freedom > 0 else math.nan

    @property
    def unexplained(self) -> bool:
        """Whether chi2 exceeds the noise: by three standard deviations of its distribution, and 10 % for noise that is itself known to 5
        %.
        """
        if self.degrees_of_freedom <= 0:
            return False
        return self.reduced_chi2 > 1.0 + max(_NOISE_UNKNOWN, 3.0 * math.sqrt(2.0 / self.degrees_of_freedom))

    @property
    def converged(self) -> bool:
        return self.status == "converged"

    def std(self, name: str) -> float | None:
        """Standard deviation of a parameter in natural units, to first order.

        Parameters
        ----------
        name : str
            Name of the parameter.

        Returns
        -------
        float or None
            None when not identifiable.
        """
        number = self.parameters.index(name)
        if not self.identifiable[number]:
            return None
        slope = self.parameters.natural_slope(self.parameters.coordinates())[number]
        return float(slope * math.sqrt(self.covariance[number, number]))

    def interval(self, name: str) -> tuple[float, float] | None:
        """95 % confidence interval of a parameter in natural units, symmetric in the estimation coordinate, within the bounds.

        Quantile of Student's t below 100 degrees of freedom, where the noise level or the covariance is hardly better known, else normal.

        Parameters
        ----------
        name : str
            Name of the parameter.

        Returns
        -------
        tuple of float or None
            Lower and upper limit; None when not identifiable.
        """
        number = self.parameters.index(name)
        if not self.identifiable[number]:
            return None
        item = self.parameters[number]
        centre = item.coordinate(item.value)
        half = self._quantile() * math.sqrt(self.covariance[number, number])
        low, high = item.natural(centre - half), item.natural(centre + half)
        return max(low, item.lower), min(high, item.upper)

    def bound(self, name: str) -> Literal["lower", "upper"] | None:
        """Which bound the 95 % interval of a parameter ends at: it is one-sided, and ± a standard deviation would leave the bounds.

        Parameters
        ----------
        name : str
            Name of the parameter.

        Returns
        -------
        {"lower", "upper"} or None
            None within the bounds, and when not identifiable.
        """
        interval, item = self.interval(name), self.parameters[name]
        if interval is None:
            return None
        return "lower" if interval[0] == item.lower else "upper" if interval[1] == item.upper else None

    def spread(self, name: str, factor: float = 1.0) -> str:
        """Uncertainty of a parameter in words, after its value: ± the standard deviation, or the limit of a one-sided 95 % interval.

        Parameters
        ----------
        name : str
            Name of the parameter.
        factor : float
            Printed unit, as 1000 for m in mm.

        Returns
        -------
        str
            "" when not identifiable.
        """
        interval, std = self.interval(name), self.std(name)
        if interval is None or std is None:
            return ""
        low, high = (f"{factor * limit:.2g}" for limit in interval)
        return {"lower": f"at most {high}", "upper": f"at least {low}"}.get(
            self.bound(name) or "", f"± {factor * std:.2g}"
        )

    def quantity(self, name: str, truth: float | None = None) -> dict[str, float | bool | str | None]:
        """Value, standard deviation and interval of a parameter as in every results file.

        Parameters
        ----------
        name : str
            Name of the parameter.
        truth : float, optional
            True value, where it is known.

        Returns
        -------
        dict
            `std`, `low` and `high` are None when not identifiable; `bound` is that of `bound`.
        """
        interval = self.interval(name)
        return {
            "estimate": float(self.parameters[name].value),
            "std": self.std(name),
            "low": interval[0] if interval else None,
            "high": interval[1] if interval else None,
            "truth": None if truth is None else float(truth),
            "identifiable": self.identifiable[self.parameters.index(name)],
            "bound": self.bound(name),
        }

    def marginal(self, names: Iterable[str]) -> tuple[np.ndarray, np.ndarray]:
        """Marginal distribution of some parameters, in estimation coordinates.

        Parameters
        ----------
        names : iterable of str
            Names of k parameters.

        Returns
        -------
        coordinates : ndarray
            Estimates (k,).
        covariance : ndarray
            Covariance (k, k).
        """
        numbers = [self.parameters.index(name) for name in names]
        return self.parameters.coordinates()[numbers], self.covariance[np.ix_(numbers, numbers)]

    @property
    def absorbed(self) -> dict[str, tuple[str, ...]]:
        """Names of the dropped parameters that each kept one has taken up, sorted: estimates with others are of other quantities."""
        found: dict[str, list[str]] = {}
        for dropped in self.dropped:
            for kept, coefficient in dropped.absorbed_by:
                if abs(coefficient) > _TAKEN_UP:
                    found.setdefault(kept, []).append(dropped.name)
        return {kept: tuple(sorted(names)) for kept, names in found.items()}

    def regrouped(self, truth: Mapping[str, float]) -> dict[str, float]:
        """Expected estimate for given true values: dropped parameters are mapped into the kept ones.

        Parameters
        ----------
        truth : mapping of float
            True values, natural units; names that it lacks are taken at the estimate.

        Returns
        -------
        dict of float
            Values by name; dropped parameters at the value they were held at.
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
