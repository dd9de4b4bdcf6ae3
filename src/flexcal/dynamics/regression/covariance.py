"""Covariance of a linear estimate with errors correlated in time and between joints, from batches of equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.inverse_model import Equations, Observation
from flexcal.dynamics.regression.assembly import RegressionData
from flexcal.dynamics.regression.autoregressive_noise import autoregressive_covariance
from flexcal.dynamics.regression.batches import Batch
from flexcal.dynamics.regression.scores import Scores

_LEVERAGE = 0.9
"""Leverage of one window on a direction from which its residual carries no information on the error."""
_WITHIN = 0.5
"""Longest time constant of noise covered by windows, as share of their length."""
_SHORT = 6.0
"""Time constant, in batches, below which windows are long enough."""


@dataclass(frozen=True, eq=False)
class BatchCovariance:
    """`covariance` (k, k) of the kept parameters, its degrees of `freedom`, and the errors' correlation length in batches: `window`."""

    covariance: np.ndarray
    freedom: float
    window: int


def batch_covariance(
    data: RegressionData,
    noise: Sequence[float],
    parameters: np.ndarray,
    kept: Sequence[int],
    root: np.ndarray,
    variance: float,
) -> BatchCovariance:
    """Sandwich covariance (WᵀW)⁻¹ M (WᵀW)⁻¹ of least squares, with M the covariance of Wᵀρ estimated from batches: `score_covariance`.

    `parameters` (p,) are the estimate; `kept` the numbers of the estimated ones among them; `root` (k, k) has root · rootᵀ = (WᵀW)⁻¹ of the
    system weighted by `noise` (one a subsystem), whose mean squared error is `variance`.
    """
    column_indices = data.observation.column_indices
    seen = [np.vstack([parameter_rows(root, kept, own), np.zeros(len(kept))]) for own in column_indices]
    missed = [np.append(-parameters[own], 1.0) for own in column_indices]
    offsets = offset_scores(data.observation, kept, root)
    return score_covariance(data.batches, noise, seen, missed, root, variance, offsets)


def offset_scores(observation: Equations, kept: Sequence[int], root: np.ndarray) -> np.ndarray | None:
    """Columns (k, ·) that map a score in coordinates of `root` (k, k) to those of the joints' torque offsets; None without offsets."""
    if not isinstance(observation, Observation):
        return None
    offsets = [i for i, number in enumerate(kept) if observation.names[number].endswith(".torque_offset")]
    return np.linalg.solve(root, np.eye(len(kept))[:, offsets]) if offsets else None


def parameter_rows(matrix: np.ndarray, kept: Sequence[int], column_indices: np.ndarray) -> np.ndarray:
    """Rows (m, k) of a matrix (k, k) for `column_indices`, of which `kept` have one; zero for the others."""
    rows_of = np.zeros((len(column_indices), matrix.shape[1]))
    _, at, rows = np.intersect1d(column_indices, kept, return_indices=True)
    rows_of[at] = matrix[rows]
    return rows_of


def score_covariance(
    experiments: Sequence[Sequence[Batch]],
    noise: Sequence[float],
    seen: Sequence[np.ndarray],
    missed: Sequence[np.ndarray],
    root: np.ndarray,
    variance: float,
    offsets: np.ndarray | None = None,
) -> BatchCovariance:
    """Covariance root · M · rootᵀ with M the covariance of the scores Qᵀρ estimated from batches (Newey & West 1987).

    A joint's columns (width) of a batch times `seen` (width, k) give its part of Q, with QᵀQ = 1 over all joints and batches, and times
    `missed` (width,) the errors ρ, both divided by the subsystem's `noise`. M sums the outer squares of the scores of all windows of ℓ
    batches that follow each other, which is Bartlett's kernel, over joints together. ℓ is the bandwidth of Andrews (1991) for the first
    autocorrelation of the scores, all parameters pooled; what that kernel leaves out where they are autoregressive is given back. The
    scores of a window are freed of what the fit took from its residuals, so that independent errors give root · rootᵀ σ² without bias (Bell
    & McCaffrey 2002). So many parameters from so few batches leave correlations uncertain: they are drawn towards those of root · rootᵀ, as
    k + ν : k with ν the degrees of freedom, 1.5 B / ℓ. Where the noise of a joint has a time constant above half a window and six batches,
    standard deviations are at least those of `autoregressive_covariance`, correlations are its own, and ν is at most the number of
    independent samples of such noise, one every two time constants; a column of `offsets` (k, ·) times a score is that of a joint's torque
    offset.
    """
    joints = len(seen)
    scores = [
        _scores(own, noise[joints * number : joints * (number + 1)], seen, missed)
        for number, own in enumerate(experiments)
    ]
    return covariance_of_scores(scores, root, variance, offsets)


def covariance_of_scores(
    experiments: Sequence[Scores],
    root: np.ndarray,
    variance: float,
    offsets: np.ndarray | None = None,
    known: np.ndarray | None = None,
) -> BatchCovariance:
    """Covariance of given scores as of `score_covariance`; `known` (k, k) is the information of a prior, in their coordinates.

    Without a prior QᵀQ = 1 of all batches; with it that and the prior's share are one.
    """
    batches, size = sum(e.batches for e in experiments), root.shape[1]
    follows = _first_autocorrelation(experiments)
    window = _bandwidth(follows, batches)
    given = np.zeros((size, size)) if known is None else known
    middle = given.copy()
    for experiment in experiments:
        middle += _windows(experiment, window, variance) / _seen_share(follows, window)
    freedom = min(batches - 1.0, 1.5 * batches / window)
    covariance = root @ middle @ root.T
    std = np.sqrt(np.diag(covariance))
    if offsets is not None:
        slow, memory = autoregressive_covariance(experiments, offsets)
        if memory > max(_SHORT, _WITHIN * window):
            freedom = max(1.0, min(freedom, 0.5 * batches / memory))
            covariance = root @ (given + slow) @ root.T
            std = np.maximum(std, np.sqrt(np.diag(covariance)))
    return BatchCovariance(mixed_covariance(covariance, root @ root.T, std, freedom), freedom, window)


def mixed_covariance(
    covariance: np.ndarray, nominal: np.ndarray, std: np.ndarray, freedom: float
) -> np.ndarray:
    """Covariance (k, k) of standard deviations `std` (k,), with the correlations of `covariance` (`freedom` degrees of freedom) shrunk
    towards those of `nominal` by the share k / (k + freedom).
    """
    share = len(std) / (len(std) + freedom)
    correlation = (1.0 - share) * _correlation(covariance) + share * _correlation(nominal)
    return correlation * np.outer(std, std)


def _correlation(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix; zero for a parameter without variance, which only a prior determines."""
    std = np.sqrt(np.diag(covariance))
    std = np.where(std > 0, std, 1.0)
    return covariance / np.outer(std, std)


def _scores(
    batches: Sequence[Batch], noise: Sequence[float], seen: Sequence[np.ndarray], missed: Sequence[np.ndarray]
) -> Scores:
    length, size = batches[-1].number + 1, seen[0].shape[1]
    score = np.zeros((length, size))
    information = np.zeros((length, size, size))
    for batch in batches:
        scaled = [factor / sigma for factor, sigma in zip(batch.factors, noise, strict=True)]
        matrix = np.vstack([factor @ q for factor, q in zip(scaled, seen, strict=True)])
        errors = np.concatenate([factor @ e for factor, e in zip(scaled, missed, strict=True)])
        score[batch.number] = errors @ matrix
        information[batch.number] = matrix.T @ matrix
    return Scores(score, information, len(batches))


def _first_autocorrelation(experiments: Sequence[Scores]) -> float:
    """Lag-one autocorrelation of the scores between batches, at most 0.97."""
    product = sum(float(np.sum(e.score[1:] * e.score[:-1])) for e in experiments)
    size = sum(float(np.sum(e.score**2)) for e in experiments)
    return min(product / size, 0.97) if size > 0 else 0.0


def _bandwidth(r: float, batches: int) -> int:
    """Andrews' (1991) bandwidth of Bartlett's kernel for first-order autoregressive scores, at most a quarter of the batches."""
    best = 1.1447 * (4 * r**2 / ((1 - r) ** 2 * (1 + r) ** 2) * batches) ** (1 / 3)
    return max(1, min(math.ceil(best), batches // 4))


def _seen_share(r: float, window: int) -> float:
    """Share of the variance of the sum of first-order autoregressive scores captured by Bartlett's weights, at most 1."""
    if r <= 0:
        return 1.0
    lag = np.arange(1, window)
    return (1 + 2 * float(np.sum((1 - lag / window) * r**lag))) * (1 - r) / (1 + r)


def _windows(experiment: Scores, window: int, variance: float) -> np.ndarray:
    """Squared corrected scores of all windows, including those that begin before the first batch or end after the last."""
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
