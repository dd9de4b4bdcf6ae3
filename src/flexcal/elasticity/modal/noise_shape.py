"""Spectral shape of the noise about a response, part of which the axis itself amplifies at its resonances."""

from __future__ import annotations

import numpy as np

from flexcal.frequency.periodic import pool_noise

_SHARES = np.concatenate([[0.0], np.geomspace(1e-3, 1e4, 22)])
"""Candidate powers of input disturbances, relative to output noise, at the response's median."""
_EVIDENT = 6.0
"""Twice the log-likelihood gain required of input disturbances over locally flat noise."""
_FEWEST = 5
"""Least number of bins for the local level."""


def noise_shape(errors: np.ndarray, response: np.ndarray, excited: np.ndarray, window: int) -> np.ndarray:
    """Relative standard deviation (K,) of errors (R, K, n_y) about a response (K, n_y, n_u), to be multiplied by a smooth level.

    Noise of the output and disturbances that pass through the response: s² = 1 + c |G|², with the c that makes the errors most likely
    (Whittle) when their level is pooled over the bins of the same kind (excited or not) of a `window`.
    """
    gain = (np.abs(response) ** 2).sum(2)
    gain = (gain / np.median(gain, axis=0)).mean(1)
    records, _, outputs = errors.shape
    level = np.maximum((np.abs(errors) ** 2).mean((0, 1)), np.finfo(float).tiny)
    power = (np.abs(errors) ** 2 / level).mean((0, 2))
    kinds = [np.flatnonzero(excited == kind) for kind in (True, False) if (excited == kind).any()]
    weight = 2.0 * records * outputs

    def deviance(shape: np.ndarray) -> float:
        relative, total = power / shape, 0.0
        for own in kinds:
            count = min(own.size, max(_FEWEST, round(window * own.size / len(power))))
            pooled = np.maximum(
                pool_noise(relative[own, None, None], own, own, count)[:, 0, 0], np.finfo(float).tiny
            )
            total += weight * float((np.log(shape[own] * pooled) + relative[own] / pooled).sum())
        return total

    tried = [1.0 + share * gain for share in _SHARES]
    deviances = [deviance(shape) for shape in tried]
    best = int(np.argmin(deviances))
    return np.sqrt(tried[best] if deviances[best] < deviances[0] - _EVIDENT else tried[0])
