"""Covariance of scores under torque noise of long memory, modelled as a first-order autoregressive process."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.dynamics.regression.scores import Scores

_BATCHES = 64
"""Largest number of batches per experiment used to detect long memory."""
_FEWEST = 12
"""Least number of contrasts between batches to detect memory."""
_SHARES = (1.0, 0.8, 0.5, 0.2)
"""Candidate shares of the autoregressive process in the variance of a batch; the rest is white."""
_LONGEST = 1 / 3
"""Longest memory, as share of the recording: longer ones are drift, which an offset absorbs."""
_STEPS = 14
_TAKEN = 1e-4
"""Share of a contrast between batches left by the fit, below which it carries no information on the noise."""


def autoregressive_covariance(experiments: Sequence[Scores], offsets: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance (k, k) of the summed scores, and the longest time constant of a joint's noise, in batches.

    A column of `offsets` (k, joints) times a score is that of a joint's torque offset: the sum of its residuals in the batch. Its size over
    the root of its information is the noise at low frequency, less what the fit took from there. Level, share and time constant have a
    posterior with flat priors (of the logarithm of the time constant; half of it on white noise), from the likelihood of these residuals
    with the covariance that the projection of the fit leaves (as restricted maximum likelihood, Patterson & Thompson 1971); the covariance
    is averaged over it, since a recording of a few time constants tells little about them.
    """
    size = len(offsets)
    total, longest = np.zeros((size, size)), 0.0
    for experiment in experiments:
        merged = -(-len(experiment.score) // _BATCHES)
        score, information = (
            _merged(values, merged) for values in (experiment.score, experiment.information)
        )
        for offset in offsets.T:
            mean = information @ offset
            level = mean @ offset
            seen = level > 1e-3 * level.max(initial=0.0)
            own, memory = _own(np.flatnonzero(seen), (score @ offset)[seen], mean[seen], level[seen])
            total += own
            longest = max(longest, memory * merged)
    return total, longest


def _merged(values: np.ndarray, count: int) -> np.ndarray:
    return np.add.reduceat(values, np.arange(0, len(values), count), axis=0)


def _own(
    number: np.ndarray, sums: np.ndarray, rows: np.ndarray, level: np.ndarray
) -> tuple[np.ndarray, float]:
    """Batches of one joint and experiment with these numbers: sums (B,) of residuals, of regressors (B, k), and numbers of rows."""
    batches, size = rows.shape
    root = np.sqrt(level)
    residual, regressors = sums / root, rows / root[:, None]
    taken, directions = np.linalg.eigh(np.eye(batches) - regressors @ regressors.T)
    contrasts = directions[:, taken > _TAKEN]
    if contrasts.shape[1] < _FEWEST:
        return np.zeros((size, size)), 0.0
    left = contrasts.T - (contrasts.T @ regressors) @ regressors.T
    others = contrasts.T @ regressors @ (np.eye(size) - regressors.T @ regressors) @ regressors.T @ contrasts
    seen = contrasts.T @ residual
    lag = np.abs(np.subtract.outer(number, number))
    sizes = np.outer(root, root) / np.mean(level)
    memories = np.geomspace(0.5, max(1.0, _LONGEST * (number[-1] + 1)), _STEPS)
    processes = np.exp(-lag / memories[:, None, None]) * sizes
    # white noise alone, then every process with every share
    of = np.concatenate([[0], np.repeat(np.arange(_STEPS), len(_SHARES))])
    shares = np.concatenate([[0.0], np.tile(_SHARES, _STEPS)])
    white = left @ left.T
    covariances = shares[:, None, None] * ((left @ processes @ left.T)[of] - white) + (white + others)
    factors = np.linalg.cholesky(covariances)
    squares = np.sum(np.linalg.solve(factors, seen[:, None]) ** 2, axis=(1, 2))
    diagonals = np.diagonal(factors, axis1=1, axis2=2)
    evidence = -np.sum(np.log(diagonals), axis=1) - 0.5 * len(seen) * np.log(squares)
    weights = np.exp(evidence - np.max(evidence))
    weights[0] *= len(shares) - 1.0
    weights /= weights.sum()
    levels = weights * squares / (len(seen) - 2.0)
    noise = np.tensordot(np.bincount(of, levels * shares), processes, 1)
    noise += (levels @ (1.0 - shares)) * np.eye(batches)
    memory = float(weights @ (shares * memories[of]))
    return regressors.T @ noise @ regressors, memory
