"""Correction of p-values for the number of tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def holm(probabilities: Sequence[float] | np.ndarray) -> np.ndarray:
    """Adjusted p-values (N,) of N tests, dependent or not (Holm 1979, Scand. J. Statist. 6).

    Calling those at or below α significant calls any true null hypothesis false with a probability of at most α over all tests together.
    """
    p = np.asarray(probabilities, dtype=float)
    order = np.argsort(p, kind="stable")
    stepped = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted
