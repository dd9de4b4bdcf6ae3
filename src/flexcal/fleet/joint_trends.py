"""Trends of many quantities of a robot together, tested with the scatter about the lines that its fleet shows."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from flexcal.fleet.excess_tail import excess_tail


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

    Values scatter from visit to visit by more than their covariances tell where something else changes, such as the temperature. How
    much more is taken from the residuals of its family, or from the unit's own where these are more, and is supposed to be all
    along one combination of the quantities, the worst case (`excess_tail`).
    """
    totals: dict[Hashable, tuple[float, float, int]] = {}
    for line in lines:
        squares, count, times = totals.get(line.family, (0.0, 0.0, 0))
        totals[line.family] = (
            squares + line.residual,
            count + line.quantities * (line.visits - 2),
            times + line.visits - 2,
        )
    tests = []
    for line in lines:
        squares, count, times = totals[line.family]
        own = line.residual / (line.quantities * (line.visits - 2))
        scale, of = squares / count, times
        if own > max(scale, 1.0):
            scale, of = own, line.visits - 2
        probability = excess_tail(line.statistic, scale * line.quantities * of, of, line.quantities)
        freedom = of * _effective(line.quantities, scale) if scale > 1 else line.freedom
        tests.append(JointTest(probability, max(scale, 1.0), min(freedom, line.freedom)))
    return tests


def _effective(count: int, scale: float) -> float:
    """Degrees of freedom of a sum of `count` squares with the mean variance `scale`, all but one of variance 1 (Box 1954)."""
    excess = count * (max(scale, 1.0) - 1)
    return (count + excess) ** 2 / (count - 1 + (1 + excess) ** 2)
