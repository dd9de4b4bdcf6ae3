"""Deviations of the individuals of a population from its mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.estimation.hierarchical_model import Measured, normal_equations

_STEPS = 60


def deviations(measured: Sequence[Measured], sizes: np.ndarray) -> np.ndarray:
    """Predicted deviations (N, p) of N individuals from their mean, each parameter over its standard deviation between individuals.

    Best linear prediction in the model of `population` (Robinson 1991), with the mean and the variances of largest likelihood, by
    expectation and maximisation. What was not measured of an individual deviates by nothing. `sizes` (p,) are plausible sizes.
    """
    information, told = normal_equations(measured, sizes)
    count, size = told.shape
    variance, mean, predicted = np.full(size, 0.1), np.zeros(size), np.zeros((count, size))
    for _ in range(_STEPS):
        precision = 1 / variance
        own = information.copy()
        own[:, range(size), range(size)] += precision
        inner = np.linalg.inv(own)
        whole = np.diag(1.0 + count * precision) - precision[:, None] * inner.sum(axis=0) * precision
        mean = np.linalg.solve(whole, precision * np.einsum("ipq,iq->p", inner, told))
        predicted = np.einsum("ipq,iq->ip", inner, told + precision * mean)
        left = np.diagonal(inner, axis1=1, axis2=2)
        variance = np.maximum(np.mean((predicted - mean) ** 2 + left, axis=0), np.finfo(float).tiny)
    return (predicted - mean) / np.sqrt(variance)
