"""Errors of several models on one logarithmic scale, in HTML without scripts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flexcal.report.layout.blocks import ErrorRange
from flexcal.report.layout.notation import millimetres
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class Step:
    """An error range with its places on the scale, in percent of the width; None where a number is not known."""

    error_range: ErrorRange
    start: float
    width: float
    mean: float | None
    p90: float | None
    maximum: float | None
    texts: tuple[str, str, str]


@dataclass(frozen=True)
class ErrorAxis:
    """Steps, and the scale's ticks as (percent, label)."""

    steps: tuple[Step, ...]
    ticks: tuple[tuple[float, str], ...]


def place_ranges(ranges: Sequence[ErrorRange]) -> ErrorAxis:
    """Place error ranges on a log scale from the decade below the smallest to that above the largest."""
    values = [
        v / MILLIMETRE for r in ranges for v in (r.mean, r.p90, r.maximum) if math.isfinite(v) and v > 0
    ]
    if not values:
        return ErrorAxis((), ())
    low = _tick_below(min(values))
    high = _tick_above(max(values))

    def place(value: float) -> float | None:
        size = value / MILLIMETRE
        if not math.isfinite(size) or size <= 0:
            return None
        return 100 * math.log(size / low) / math.log(high / low)

    steps = []
    for error_range in ranges:
        mean, p90, maximum = place(error_range.mean), place(error_range.p90), place(error_range.maximum)
        known = [p for p in (mean, p90, maximum) if p is not None]
        if not known:
            continue
        texts = (
            millimetres(error_range.mean),
            millimetres(error_range.p90),
            millimetres(error_range.maximum),
        )
        steps.append(Step(error_range, min(known), max(known) - min(known), mean, p90, maximum, texts))
    ticks = [m * 10.0**e for e in range(-4, 4) for m in (1, 2, 5)]
    sparse = [t for t in ticks if low * 0.999 <= t <= high * 1.001]
    if len(sparse) > 7:
        sparse = [t for t in sparse if f"{t:e}".startswith("1")]
    return ErrorAxis(
        tuple(steps), tuple((100 * math.log(t / low) / math.log(high / low), f"{t:g}") for t in sparse)
    )


def _tick_below(value: float) -> float:
    decade = 10.0 ** math.floor(math.log10(value))
    return max(m * decade for m in (0.5, 1, 2, 5) if m * decade <= value * 0.999)


def _tick_above(value: float) -> float:
    decade = 10.0 ** math.floor(math.log10(value))
    return min(m * decade for m in (1, 2, 5, 10, 20) if m * decade >= value * 1.001)
