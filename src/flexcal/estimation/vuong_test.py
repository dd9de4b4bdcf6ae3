"""Vuong's test of two non-nested models (Vuong 1989)."""

from __future__ import annotations

import numpy as np


def vuong_statistic(first: np.ndarray, second: np.ndarray, groups: np.ndarray, common: float = 0.0) -> float:
    """Vuong's statistic of the whitened residuals (m,) of two models; positive if the first is better.

    The log likelihoods, each with the scatter that its model leaves, are summed over rows of one group (m,), numbered from 0, which need
    not be independent. The sum of their differences over its standard deviation is standard normal where both models are equally far from
    the truth, whatever that is. `common` is what no group has of the log likelihood ratio: determinants of the covariances, priors.
    """
    squares = np.array([first, second]) ** 2
    variance = np.maximum(squares.mean(axis=1, keepdims=True), np.finfo(float).tiny)
    likelihood = -0.5 * (np.log(variance) + squares / variance)
    gain = np.bincount(groups, likelihood[0] - likelihood[1])
    spread = np.sqrt(len(gain)) * gain.std()
    return float((gain.sum() + common) / spread) if spread > 0 else 0.0
