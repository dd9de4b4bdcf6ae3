"""Variances of few degrees of freedom, moderated towards a common one (Smyth 2004)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import digamma, polygamma


def moderated(variances: np.ndarray, freedom: float) -> tuple[np.ndarray, float]:
    """Posterior means of the precisions, inverted (k,), and their degrees of freedom.

    Each of the `variances` (k,) has so many degrees of `freedom`. The true ones have an inverse chi-squared prior, whose level and
    degrees of freedom come from the mean and the variance of the logarithms (Smyth 2004, Eqs. 2, 5 and 6); these are at most those of all
    `variances` together, which a common one would have.
    """
    if len(variances) == 1:
        return variances, freedom
    most = (len(variances) - 1) * freedom
    logs = np.log(np.maximum(variances, np.finfo(float).tiny))
    excess = np.var(logs, ddof=1) - float(polygamma(1, freedom / 2))
    if excess <= float(polygamma(1, most / 2)):
        prior = most
    else:
        prior = 2 * float(
            root_scalar(lambda half: float(polygamma(1, half)) - excess, bracket=(1e-6, most / 2)).root
        )
    level = np.exp(
        np.mean(logs) - digamma(freedom / 2) + np.log(freedom / 2) + digamma(prior / 2) - np.log(prior / 2)
    )
    return (prior * level + freedom * variances) / (prior + freedom), prior + freedom
