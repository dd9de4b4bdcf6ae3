"""When a trend reaches a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexcal.fleet.trends import Trend


@dataclass(frozen=True)
class Crossing:
    """Time at which a rising line reaches a limit, and the 95 % interval of that time; infinite where it has no end."""

    time: float
    low: float
    high: float


def crossing(trend: Trend, limit: float, level: float = 0.95) -> Crossing | None:
    """Time at which a trend reaches a limit from below, by Fieller's interval: all times at which the line's own interval holds the limit.

    None where the slope is not positive at that level, since the interval then has no end.
    """
    from scipy.stats import t

    quantile = float(t.ppf((1 + level) / 2, trend.freedom))
    (c00, c01), (_, c11) = quantile**2 * trend.covariance
    below = limit - trend.value
    if trend.slope <= 0 or trend.slope**2 <= c11:
        return None
    # (below − slope u)² = c00 + 2 c01 u + c11 u², u counted from the centre
    square, linear, constant = trend.slope**2 - c11, -2 * (below * trend.slope + c01), below**2 - c00
    root = math.sqrt(max(0.0, linear**2 - 4 * square * constant))
    low, high = np.array([-linear - root, -linear + root]) / (2 * square)
    return Crossing(trend.centre + below / trend.slope, trend.centre + float(low), trend.centre + float(high))
