"""Linear trends of many units over time, tested with a variance that all of them tell."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np

FEWEST_VISITS = 3
"""Least number of visits of a trend."""
_FEWEST_COURSES = 10
"""Least number of courses whose scatter says something of the others'."""
_CAUTION = 1.645
"""Standard errors by which variances are taken to differ more between courses than they seem to (one-sided 95 %)."""
_SMALLEST = 1e-5
"""Smallest scatter that is believed, over the median scatter of all courses."""


@dataclass(frozen=True, eq=False)
class Course:
    """Values (K,) at times (K,), with standard deviations (K,) of measurement, of one quantity of one unit.

    Courses of one `family`, such as one parameter of robots of one model, share the variance of whatever differs from visit to visit
    beyond the uncertainty of measurement.
    """

    time: np.ndarray
    values: np.ndarray
    std: np.ndarray
    family: Hashable = None


@dataclass(frozen=True, eq=False)
class Trend:
    """Straight line through a course: `value` at `centre` and `slope` per time, their covariance (2, 2) and its degrees of freedom, and
    the p-value of a slope of zero (two-sided).
    """

    centre: float
    value: float
    slope: float
    covariance: np.ndarray
    freedom: float
    probability: float

    def at(self, time: float) -> float:
        """Value of the line at a time."""
        return self.value + self.slope * (time - self.centre)

    def slope_interval(self, level: float) -> tuple[float, float]:
        """Interval of the slope with the probability `level`."""
        from scipy.stats import t

        half = float(t.ppf((1 + level) / 2, self.freedom)) * math.sqrt(self.covariance[1, 1])
        return self.slope - half, self.slope + half


def moderated_trends(courses: Sequence[Course]) -> list[Trend]:
    """Weighted straight lines through courses of three visits or more at two times or more, in their order.

    Measurements of a family scatter by their own variance and a common one from visit to visit, which is estimated by moments over its
    courses (as DerSimonian and Laird 1986, Control. Clin. Trials 7). The scatter about each line, of few degrees of freedom, is moderated
    by that of all other courses: an inverse-gamma prior of the variances is fitted to them (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3,
    section 6.2), with as much difference between the courses as the 95 % bound of its estimate allows, and the slope has Student's t with
    the degrees of freedom of both. Where variances differ widely between courses, or there are few, this is the ordinary t-test.
    """
    common = _visit_variances(courses)
    lines = [_line(course, common[course.family]) for course in courses]
    scatter = np.array([line.scatter for line in lines])
    freedom = np.array([len(course.time) - 2.0 for course in courses])
    prior_freedom, prior = _variance_prior(scatter, freedom)
    if math.isinf(prior_freedom):
        moderated, total = np.full(len(lines), prior), np.full(len(lines), np.inf)
    else:
        total = prior_freedom + freedom
        moderated = (prior_freedom * prior + freedom * scatter) / total
    total = np.minimum(total, freedom.sum())
    return [
        _trend(line, float(factor), float(degrees))
        for line, factor, degrees in zip(lines, moderated, total, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class _Line:
    """Weighted fit: centre, coefficients (2,) there, their covariance (2, 2) for stated variances, mean square of whitened residuals."""

    centre: float
    coefficients: np.ndarray
    covariance: np.ndarray
    scatter: float


def _line(course: Course, common: float) -> _Line:
    variance = course.std**2 + common
    weights = 1.0 / variance
    centre = float(weights @ course.time / weights.sum())
    design = np.stack([np.ones(len(course.time)), course.time - centre], axis=1)
    covariance = np.linalg.inv((design.T * weights) @ design)
    coefficients = covariance @ ((design.T * weights) @ course.values)
    residual = course.values - design @ coefficients
    return _Line(centre, coefficients, covariance, float(weights @ residual**2) / (len(course.time) - 2))


def _trend(line: _Line, factor: float, freedom: float) -> Trend:
    from scipy.special import stdtr

    covariance = factor * line.covariance
    slope = float(line.coefficients[1])
    score = abs(slope) / math.sqrt(covariance[1, 1]) if covariance[1, 1] > 0 else 0.0
    return Trend(
        line.centre,
        float(line.coefficients[0]),
        slope,
        covariance,
        freedom,
        2 * float(stdtr(freedom, -score)),
    )


def _visit_variances(courses: Sequence[Course]) -> dict[Hashable, float]:
    """Variance from visit to visit beyond that of measurement, of every family."""
    excess: dict[Hashable, float] = {}
    expected: dict[Hashable, float] = {}
    for course in courses:
        weights = 1.0 / course.std**2
        design = np.stack([np.ones(len(course.time)), course.time - course.time.mean()], axis=1)
        inverse = np.linalg.inv((design.T * weights) @ design)
        residual = course.values - design @ (inverse @ ((design.T * weights) @ course.values))
        squares = float(weights @ residual**2) - (len(course.time) - 2)
        rise = float(weights.sum() - np.trace(inverse @ ((design.T * weights**2) @ design)))
        excess[course.family] = excess.get(course.family, 0.0) + squares
        expected[course.family] = expected.get(course.family, 0.0) + rise
    return {family: max(0.0, excess[family] / expected[family]) for family in excess}


def _variance_prior(scatter: np.ndarray, freedom: np.ndarray) -> tuple[float, float]:
    """Degrees of freedom and scale of the prior of variances, by the moments of the logarithms of `scatter` (N,), mean squares of
    `freedom` (N,) degrees; 0 degrees for few, infinitely many where all variances are alike.
    """
    from scipy.special import digamma, polygamma

    if len(scatter) < _FEWEST_COURSES or not scatter.max() > 0:
        return 0.0, 1.0
    middle = float(np.median(scatter)) or float(scatter.max())
    logs = np.log(np.maximum(scatter, _SMALLEST * middle)) - digamma(freedom / 2) + np.log(freedom / 2)
    mean = float(logs.mean())
    squares = (logs - mean) ** 2
    spread = float(logs.var(ddof=1) - polygamma(1, freedom / 2).mean())
    spread += _CAUTION * float(squares.std(ddof=1)) / math.sqrt(len(logs))
    if spread <= 0:
        return math.inf, math.exp(mean)
    prior = 2 * _inverse_trigamma(spread)
    return prior, math.exp(mean + float(digamma(prior / 2)) - math.log(prior / 2))


def _inverse_trigamma(value: float) -> float:
    """Argument at which the trigamma function has this value, by Newton's method on its reciprocal (Smyth 2004, appendix)."""
    from scipy.special import polygamma

    if value > 1e7:
        return 1 / math.sqrt(value)
    x = 0.5 + 1 / value
    for _ in range(50):
        trigamma = float(polygamma(1, x))
        step = trigamma * (1 - trigamma / value) / float(polygamma(2, x))
        x += step
        if -step / x < 1e-10:
            break
    return x
