"""Quantiles of Student's t; `scipy.special.stdtrit` gives the same to 3e-9, but its import takes as long as a verb's start-up (0.15 s)."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

_NODES = 64
_STEPS = 50


@cache
def student_quantile(probability: float, freedom: float) -> float:
    """Quantile of Student's t with `freedom` degrees of freedom (1 or more) at `probability` (0.5 to 1).

    With t = √ν tan θ the distribution is the integral of cos^(ν-1) θ, by Gauss and Legendre; Newton's steps come from below.
    """
    density = math.exp(math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2)) / math.sqrt(math.pi)
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    angle = 0.0
    for _ in range(_STEPS):
        between = 0.5 * angle * (1.0 + nodes)
        reached = 0.5 * angle * density * float(weights @ np.cos(between) ** (freedom - 1))
        step = (probability - 0.5 - reached) / (density * math.cos(angle) ** (freedom - 1))
        angle += step
        if abs(step) < 1e-15:
            break
    return math.sqrt(freedom) * math.tan(angle)
