"""Uncertainty of an estimate whose prior's sizes were estimated from the same readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.calibration.error_model import SCATTER_SPREAD

FACTOR_SPREAD = float(np.log(2.0))
"""Standard deviation of the logarithm of the factor by which the errors of a kind are larger than the usual ones."""


def widening(
    information: np.ndarray,
    prior: np.ndarray,
    shift: np.ndarray,
    names: Sequence[str],
    kinds: Mapping[str, str],
    readings: int,
) -> np.ndarray:
    """What the uncertainty of the sizes adds to the covariance (p, p) of an estimate (Kass & Steffey 1989).

    Scatter and prior are taken to have the sizes of largest marginal likelihood. By the law of total variance, the mean of the covariance
    over the sizes, for which those of their root mean square stand, and the covariance of the estimate over them come in their place. The
    sizes' logarithms are normal with the expected information of the marginal likelihood and of their own priors.

    Parameters
    ----------
    information : ndarray
        Information (p, p) of the readings about the parameters `names`, in inverse squares of their units.
    prior : ndarray
        Prior covariance (p, p), infinite on the diagonal where there is none.
    shift : ndarray
        Estimate (p,) minus the prior's mean.
    names : sequence of str
        Names of the parameters.
    kinds : mapping of str
        Kinds of those parameters whose prior standard deviations have an estimated factor in common, by name.
    readings : int
        Number of readings.

    Returns
    -------
    ndarray
        Matrix (p, p) to add.
    """
    known = np.isfinite(np.diag(prior))
    unit = np.where(known, np.sqrt(np.where(known, np.diag(prior), 1.0)), 1.0)
    free = ~known & (np.diag(information) > 0)
    unit[free] = 1 / np.sqrt(np.diag(information)[free])
    told = information * unit * unit[:, None]
    own = np.ix_(known, known)
    before = np.where(known & known[:, None], prior, 0.0) / (unit * unit[:, None])
    precision = np.zeros_like(told)
    precision[own] = np.linalg.inv(before[own])
    covariance = _inverse(told + precision)
    left = covariance @ precision
    pulled = precision @ (shift / unit)
    # variance of the readings about the prior's mean, in that of their scatter: what falls on the columns
    marginal, share = precision - precision @ left, np.eye(len(told)) - left
    groups = list(dict.fromkeys(kinds.values()))
    member = np.array([[kinds.get(name) == group for name in names] for group in groups], dtype=float)
    fisher = np.empty((len(groups) + 1, len(groups) + 1))
    fisher[:-1, :-1] = 2 * member @ marginal**2 @ member.T
    fisher[-1, :-1] = fisher[:-1, -1] = 2 * member @ np.diag(left.T @ marginal)
    fisher[-1, -1] = 2 * (readings - 2 * np.trace(share) + np.trace(share @ share))
    fisher += np.diag([*[FACTOR_SPREAD**-2] * len(groups), 0.5 * SCATTER_SPREAD**-2])
    sizes = np.linalg.inv(fisher)
    moved = 2 * covariance @ np.column_stack([precision @ (member * pulled).T, -pulled])
    larger = np.expm1(2 * np.diag(sizes))
    before[own] += np.diag(larger[:-1] @ member)[own]
    less = precision.copy()
    less[own] -= np.linalg.inv(before[own])
    less += told * (larger[-1] / (1 + larger[-1]))
    # what the covariance grows by where the information is less by that; the difference of both would be rounding
    grown = covariance @ less @ _inverse(told + precision - less)
    # rounding where readings are nearly exact makes no variance negative
    values, axes = np.linalg.eigh((grown + grown.T) / 2 + moved @ sizes @ moved.T)
    return (axes * np.maximum(values, 0.0)) @ axes.T * unit * unit[:, None]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse (p, p) of a positive semidefinite matrix whose rows differ in size; pseudo-inverse where it is singular."""
    size = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    size = size * size[:, None]
    return np.linalg.pinv(matrix / size, hermitian=True) / size
