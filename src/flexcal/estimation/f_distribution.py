"""Tail of the F distribution; `scipy.special.fdtrc` gives the same to 1e-9, but its import takes as long as a verb's start-up (0.15 s)."""

from __future__ import annotations

import math

_STEPS = 10_000
_TINY = 1e-300


def f_tail(first: float, second: float, ratio: float) -> float:
    """Probability that F with `first` and `second` degrees of freedom exceeds `ratio`: the regularised incomplete beta function."""
    if not ratio > 0:
        return 1.0
    a, b = second / 2, first / 2
    x, rest = second / (second + first * ratio), first * ratio / (second + first * ratio)
    if math.isinf(ratio) or x == 0:
        return 0.0
    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log(rest)
    if x < (a + 1) / (a + b + 2):
        return math.exp(front) * _fraction(a, b, x) / a
    return 1.0 - math.exp(front) * _fraction(b, a, rest) / b


def _fraction(a: float, b: float, x: float) -> float:
    """Continued fraction of the incomplete beta function (DLMF 8.17.22) by the modified method of Lentz."""
    c, d = 1.0, 1.0 / _away(1.0 - (a + b) * x / (a + 1.0))
    value = d
    for m in range(1, _STEPS):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for term in (even, odd):
            c, d = _away(1.0 + term / c), 1.0 / _away(1.0 + term * d)
            value *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return value


def _away(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
