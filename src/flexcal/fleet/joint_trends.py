"""Trends of many quantities of a robot together, tested with the scatter about the lines that its fleet shows."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.fleet.visit_scatter import excess_tails


@dataclass(frozen=True)
class JointLine:
    """Lines through m `quantities` of one unit over K `visits`.

    `statistic` and `residual` are the sums of squares of the slopes and of the values about the lines, whitened by the covariances of
    measurement: χ² with m and (K − 2) m degrees of freedom where these are right and nothing drifts. `freedom` are those of the
    covariances themselves. Units of one `family` scatter alike.
    """

    quantities: int
    visits: int
    statistic: float
    residual: float
    freedom: float
    family: Hashable = None


@dataclass(frozen=True)
class JointTest:
    """The p-value of no trend, and the factor of the variances of measurement, with its degrees of freedom."""

    probability: float
    scale: float
    freedom: float


def joint_tests(lines: Sequence[JointLine]) -> list[JointTest]:
    """Tests of lines, of three visits or more, in their order.

    Values scatter from visit to visit by more than their covariances tell where something else changes, such as the temperature, and by
    more in some units than in others. How much more is taken from the residuals of the unit and of its family, and is supposed to be all
    along one combination of the quantities, the worst case (`excess_tails`).
    """
    families: dict[Hashable, list[int]] = {}
    for number, line in enumerate(lines):
        families.setdefault(line.family, []).append(number)
    tests: dict[int, JointTest] = {}
    for members in families.values():
        own = [lines[number] for number in members]
        tests.update(zip(members, _tests_of_family(own), strict=True))
    return [tests[number] for number in range(len(lines))]


def _tests_of_family(lines: Sequence[JointLine]) -> list[JointTest]:
    visits = np.array([line.visits - 2 for line in lines])
    quantities = np.array([line.quantities for line in lines])
    residuals = np.array([line.residual for line in lines])
    statistics = np.array([line.statistic for line in lines])
    probabilities = excess_tails(statistics, residuals, visits, quantities)
    common = residuals.sum() / (visits @ quantities)
    tests = []
    for line, own, p in zip(lines, residuals / (visits * quantities), probabilities, strict=True):
        scale, of = (own, line.visits - 2) if own > max(common, 1.0) else (common, int(visits.sum()))
        freedom = of * _effective(line.quantities, float(scale)) if scale > 1 else line.freedom
        tests.append(JointTest(float(p), max(float(scale), 1.0), min(freedom, line.freedom)))
    return tests


def _effective(count: int, scale: float) -> float:
    """Degrees of freedom of a sum of `count` squares with the mean variance `scale`, all but one of variance 1 (Box 1954)."""
    excess = count * (max(scale, 1.0) - 1)
    return (count + excess) ** 2 / (count - 1 + (1 + excess) ** 2)
