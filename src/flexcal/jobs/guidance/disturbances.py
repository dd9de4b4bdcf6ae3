"""Disturbances of a series of measured points: one wrong row, an instrument that moved, a drift; tested on the residuals of an estimate.

With residuals r = V⁻¹ (y − J μ) of the prior-weighted estimate, whitened by the noise, and columns E of a disturbance whose size has a
normal prior, the score g = Eᵀ r and C = Eᵀ V⁻¹ E give the statistic gᵀ C⁻¹ g (Rao) and the ratio of the marginal likelihoods, both with
the noise estimated from the same residuals (Cook and Weisberg 1982, section 2.2.2; Kass and Raftery 1995).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.jobs.guidance.estimate import SessionEstimate
from flexcal.units import MILLIMETRE

DisturbanceKind = Literal["outlier", "moved", "drift"]
CHANCE = 3e-4
"""Largest p-value of a disturbance, multiplied by the number of those of its kind that were tried."""
ODDS = 20.0
"""Least posterior odds of a disturbance against none."""
_BEFORE = {"outlier": 1e-2, "moved": 1e-2, "drift": 1e-2}
"""Odds of each kind beforehand, shared by all rows at which it may be."""
_SIZES = (0.2 * MILLIMETRE, 1 * MILLIMETRE, 5 * MILLIMETRE)
"""Standard deviations of the shift, m, that are tried: of one row, of the instrument, and of a drift over the whole series."""


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Disturbance of N rows: `row` is the only one, or the first, concerned; `columns` (N, 3, k), m, are its effects in units of its prior.

    `p` is its p-value times the number of `tries`, `odds` the natural logarithm of its posterior odds.
    """

    kind: DisturbanceKind
    row: int
    columns: np.ndarray
    tries: int
    p: float
    odds: float

    @property
    def key(self) -> tuple[DisturbanceKind, int]:
        """What it is, whatever its size; a drift has no row."""
        return self.kind, self.row


def most_probable(estimate: SessionEstimate, known: list[Disturbance]) -> Disturbance | None:
    """The most probable disturbance beside those `known`, whose columns the estimate has; None where none is certain."""
    scores = _Scores(estimate)
    taken = {item.key for item in known}
    best: Disturbance | None = None
    for kind, rows, columns in _families(estimate, taken):
        odds, p, size = scores.of(columns)
        p = np.minimum(p * len(rows), 1.0)
        odds += np.log(_BEFORE[kind] / len(rows))
        odds[(p > CHANCE) | (odds < np.log(ODDS))] = -np.inf
        k = int(np.argmax(odds))
        if odds[k] > (-np.inf if best is None else best.odds):
            effect = _effect(kind, int(rows[k]), columns) * size[k]
            best = Disturbance(kind, int(rows[k]), effect, len(rows), float(p[k]), float(odds[k]))
    return best


def verified(estimate: SessionEstimate, item: Disturbance) -> Disturbance | None:
    """A disturbance, the last of an estimate, with the p-value under the scatter that is left with it; None where it is not certain then.

    Scores at few degrees of freedom count scatter as explained that the plausible sizes of the parameters have taken up.
    """
    from scipy.special import fdtrc

    size = item.columns.shape[2]
    inverse = np.linalg.inv(estimate.covariance[-size:, -size:])
    values, vectors = np.linalg.eigh(inverse - np.eye(size))
    told = values > 1e-9 * max(float(values[-1]), 1e-12)
    along = (vectors.T @ (inverse @ estimate.change[-size:]))[told]
    statistic = float(np.sum(along**2 / values[told]))
    p = min(float(fdtrc(size, estimate.freedom, statistic / size)) * item.tries, 1.0)
    return replace(item, p=p) if p < CHANCE else None


@dataclass(frozen=True, eq=False)
class _Family:
    """Disturbances of one kind: the columns (N, 3, k) of a row of a mask (N,); each begins at one of the `first` rows, or is of one row."""

    every: np.ndarray
    mask: np.ndarray
    first: np.ndarray | None = None


def _families(
    estimate: SessionEstimate, taken: set[tuple[DisturbanceKind, int]]
) -> Iterator[tuple[DisturbanceKind, np.ndarray, _Family]]:
    rows, count = estimate.rows, len(estimate.rows)
    single = np.array([i for i in range(count) if ("outlier", i) not in taken], dtype=int)
    eye = np.broadcast_to(np.eye(3), (count, 3, 3))
    if len(single):
        yield "outlier", single, _Family(eye, np.ones(count, bool))
    for station in rows.stations:
        own = rows.station == station
        index = np.flatnonzero(own)
        first = np.array([i for i in index[1:-1].tolist() if ("moved", i) not in taken], dtype=int)
        if len(first):
            yield "moved", first, _Family(_rigid(rows.position, own), own, first)
    if ("drift", 0) not in taken and count >= 3:
        course = np.linspace(-0.5, 0.5, count)[:, None, None] * eye
        yield "drift", np.zeros(1, dtype=int), _Family(course, np.ones(count, bool), np.zeros(1, dtype=int))


def _rigid(position: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Displacements (N, 3, 6) by small rigid motions about the centre of the `own` rows, rotations in units of their extent."""
    apart = position - position[own].mean(axis=0)
    extent = max(float(np.sqrt((apart[own] ** 2).sum(axis=1).mean())), 1e-3)
    turned = np.cross(np.eye(3)[None], apart[:, None]).swapaxes(1, 2) / extent
    return np.concatenate([np.broadcast_to(np.eye(3), (len(position), 3, 3)), turned], axis=2)


class _Scores:
    """Scores of disturbances on the residuals of an estimate."""

    def __init__(self, estimate: SessionEstimate) -> None:
        self.weight = 1 / estimate.std
        self.residual = estimate.residual * self.weight[:, None]
        self.jacobian = estimate.jacobian * self.weight[:, None, None]
        self.covariance, self.freedom = estimate.covariance, estimate.freedom

    def of(self, family: _Family) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Log odds (K,) for even odds beforehand, p-values (K,), and prior sizes (K,), m, of the disturbances of a family."""
        columns = family.every * (self.weight * family.mask)[:, None, None]
        crossed = np.swapaxes(columns, 1, 2)
        score = np.matmul(crossed, self.residual[:, :, None])[:, :, 0]
        own, mixed = crossed @ columns, crossed @ self.jacobian
        if family.first is not None:
            score, own, mixed = (np.cumsum(a[::-1], axis=0)[::-1][family.first] for a in (score, own, mixed))
        information = own - mixed @ self.covariance @ np.swapaxes(mixed, 1, 2)
        return self._odds(score, information)

    def _odds(self, score: np.ndarray, information: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        from scipy.special import fdtrc

        count, k = score.shape
        eye = np.eye(k)
        # in units of a millimetre, so that what is singular is told
        score, information = score * MILLIMETRE, information * MILLIMETRE**2
        values, vectors = np.linalg.eigh(information)
        told = values > 1e-9 * np.maximum(values[:, -1:], 1e-12)
        along = np.matmul(np.swapaxes(vectors, 1, 2), score[:, :, None])[:, :, 0]
        statistic = np.where(told, along**2 / np.where(told, values, 1.0), 0.0).sum(axis=1)
        freedom = max(self.freedom, k + 1.0)
        used = np.minimum(statistic, 0.9999 * freedom)
        p = fdtrc(k, freedom - k, (used / k) / ((freedom - used) / (freedom - k)))
        odds, sizes = np.full(count, -np.inf), np.zeros(count)
        for size in _SIZES:
            unit = size / MILLIMETRE
            whole = eye + unit**2 * information
            gain = unit**2 * np.einsum("ki,kij,kj->k", score, np.linalg.inv(whole), score)
            gain = np.minimum(gain, 0.9999 * freedom)
            own = -0.5 * freedom * np.log1p(-gain / freedom) - 0.5 * np.linalg.slogdet(whole)[1]
            better = own > odds
            odds, sizes = np.where(better, own, odds), np.where(better, size, sizes)
        return odds - np.log(len(_SIZES)), p, sizes


def _effect(kind: DisturbanceKind, row: int, family: _Family) -> np.ndarray:
    """Columns (N, 3, k) of one disturbance, for a size of one."""
    at = np.arange(len(family.every))
    concerned = family.mask & (at == row if kind == "outlier" else at >= row)
    return family.every * concerned[:, None, None]
