"""Limits of chi-square; `scipy.special.chdtri` gives the same to 1e-12, but its import takes as long as a verb's start-up (0.15 s)."""

from __future__ import annotations

import math

_STEPS = 100


def chi_square_limit(freedom: int, probability: float) -> float:
    """Value that chi-square with `freedom` degrees of freedom (1 or more) exceeds with a `probability` (0 to 0.3).

    Newton's steps on the logarithm of the tail, from its mean; that is convex with one degree of freedom, else concave, so they converge.
    """
    value = float(freedom)
    for _ in range(_STEPS):
        tail, density = _tail_and_density(freedom, value)
        step = math.log(tail / probability) * tail / density
        value += step
        if abs(step) < 1e-14 * value:
            break
    return value


def _tail_and_density(freedom: int, value: float) -> tuple[float, float]:
    """Tail and density of chi-square, from those with two degrees of freedom less (Abramowitz & Stegun 26.4.4 and 26.4.5)."""
    half = value / 2
    if freedom % 2:
        known, tail = 1, math.erfc(math.sqrt(half))
        density = math.exp(-half) / math.sqrt(2 * math.pi * value)
    else:
        known, tail, density = 2, math.exp(-half), math.exp(-half) / 2
    for count in range(known + 2, freedom + 1, 2):
        density *= value / (count - 2)
        tail += 2 * density
    return tail, density
