"""The covariance of a linear estimate whose errors hang together in time and between joints, from batches of equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.regression import RegressionData

_LEVERAGE = 0.9
"""A direction that one window determines to this share, or more, leaves no residual there that would tell its error."""


@dataclass(frozen=True, eq=False)
class BatchCovariance:
    """`covariance` (k, k) of the kept parameters, its degrees of `freedom`, and over how many batches errors hang together: `window`."""

    covariance: np.ndarray
    freedom: float
    window: int


@dataclass(frozen=True, eq=False)
class _Scores:
    """Of one experiment, batch by batch (zero for one without rows), in coordinates in which WᵀW is one.

    `score` (B, k) is Wᵀ times the residual, `information` (B, k, k) WᵀW; `batches` have rows.
    """

    score: np.ndarray
    information: np.ndarray
    batches: int


def batch_covariance(
    data: RegressionData,
    noise: Sequence[float],
    parameters: np.ndarray,
    kept: Sequence[int],
    root: np.ndarray,
    variance: float,
) -> BatchCovariance:
    """(WᵀW)⁻¹ M (WᵀW)⁻¹ with M the covariance of Wᵀρ as the batches show it (Newey & West 1987).

    `parameters` (p,) are the estimate; `kept` the numbers of the estimated ones among them; `root` (k, k) has root · rootᵀ = (WᵀW)⁻¹ of the
    system weighted by `noise` (one a subsystem), whose mean squared error is `variance`. M sums the outer squares of the scores of
    all windows of ℓ batches that follow each other, which is Bartlett's kernel, over joints together. ℓ is the bandwidth of Andrews (1991)
    for the first autocorrelation of the scores, all parameters pooled. The scores of a window are freed of what the fit took from its
    residuals, so that independent errors give (WᵀW)⁻¹ σ² without bias (Bell & McCaffrey 2002). So many parameters from so few batches
    leave correlations uncertain: they are drawn towards those of (WᵀW)⁻¹, as k + ν : k with ν the degrees of freedom, 1.5 B / ℓ.
    """
    experiments = _scores(data, noise, parameters, kept, root)
    batches = sum(e.batches for e in experiments)
    window = _bandwidth(experiments, batches)
    size = len(kept)
    middle = np.zeros((size, size))
    for experiment in experiments:
        middle += _windows(experiment, window, variance)
    freedom = min(batches - 1.0, 1.5 * batches / window)
    found = root @ middle @ root.T
    std = np.sqrt(np.diag(found))
    nominal = root @ root.T
    expected = np.sqrt(np.diag(nominal))
    share = size / (size + freedom)
    mixed = (1.0 - share) * found + share * nominal * np.outer(std / expected, std / expected)
    return BatchCovariance(mixed, freedom, window)


def _scores(
    data: RegressionData,
    noise: Sequence[float],
    parameters: np.ndarray,
    kept: Sequence[int],
    root: np.ndarray,
) -> list[_Scores]:
    place = {number: i for i, number in enumerate(kept)}
    equations = len(data.observation.members)
    columns = [
        np.array([i for i, m in enumerate(members) if m in place]) for members in data.observation.members
    ]
    roots = [
        root[[place[m] for m in members[at]]] for members, at in zip(data.observation.members, columns, strict=True)
    ]  # fmt: skip
    found = []
    for number, batches in enumerate(data.batches):
        length = batches[-1].number + 1
        score = np.zeros((length, len(kept)))
        information = np.zeros((length, len(kept), len(kept)))
        for batch in batches:
            seen, missed = [], []
            for equation, factor in enumerate(batch.factors):
                sigma = noise[number * equations + equation]
                seen.append(factor[:, columns[equation]] @ roots[equation] / sigma)
                members = data.observation.members[equation]
                missed.append((factor[:, -1] - factor[:, :-1] @ parameters[members]) / sigma)
            matrix = np.vstack(seen)
            score[batch.number] = np.concatenate(missed) @ matrix
            information[batch.number] = matrix.T @ matrix
        found.append(_Scores(score, information, len(batches)))
    return found


def _bandwidth(experiments: Sequence[_Scores], batches: int) -> int:
    """Andrews' (1991) bandwidth of Bartlett's kernel for first-order autoregressive scores, at most a quarter of the batches."""
    product = sum(float(np.sum(e.score[1:] * e.score[:-1])) for e in experiments)
    size = sum(float(np.sum(e.score**2)) for e in experiments)
    r = min(max(product / size, 0.0), 0.97) if size > 0 else 0.0
    best = 1.1447 * (4 * r**2 / ((1 - r) ** 2 * (1 + r) ** 2) * batches) ** (1 / 3)
    return max(1, min(math.ceil(best), batches // 4))


def _windows(experiment: _Scores, window: int, variance: float) -> np.ndarray:
    """The squares of the corrected scores of all windows, those that begin before the first batch or end after the last included."""
    size = experiment.score.shape[1]
    score = _moving_sum(experiment.score, window)
    information = _moving_sum(experiment.information, window)
    plain = np.linalg.norm(information, axis=(1, 2)) < _LEVERAGE
    left = np.linalg.cholesky(np.eye(size) - information[plain])
    corrected = np.linalg.solve(left, score[plain][..., None])[..., 0]
    total = corrected.T @ corrected
    for z, taken in zip(score[~plain], information[~plain], strict=True):
        share, directions = np.linalg.eigh(taken)
        seen = share < _LEVERAGE
        free = directions[:, seen] @ (directions[:, seen].T @ z / np.sqrt(1.0 - share[seen]))
        blind = directions[:, ~seen] * np.sqrt(share[~seen])
        total += np.outer(free, free) + variance * blind @ blind.T
    return total / window


def _moving_sum(values: np.ndarray, window: int) -> np.ndarray:
    sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    start = np.arange(1 - window, len(values))
    return sums[np.minimum(start + window, len(values))] - sums[np.maximum(start, 0)]
