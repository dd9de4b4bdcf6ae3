"""Covariance of the difference of two estimates that share what was known beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.estimation import Estimate


@dataclass(frozen=True, eq=False)
class SplitCovariance:
    """Covariance of an estimate, over `names` (p) in natural units: `noise` (p, p) of the measurements, and `known` (p, k), its columns the
    effect on the estimate of one standard deviation of each of `sources`, of which only a prior is known.

    A posterior of covariance C with the prior covariance P of its parameters has C P⁻¹ C of the prior, for which the columns C P⁻¹ᐟ² stand,
    and the remainder of the noise. A parameter that is held has its column by the estimate's response to it.
    """

    names: tuple[str, ...]
    noise: np.ndarray
    known: np.ndarray
    sources: tuple[str, ...]


def split_covariance(
    estimate: Estimate,
    names: Sequence[str],
    prior: Mapping[str, float],
    joint: tuple[Sequence[str], np.ndarray],
) -> SplitCovariance:
    """Covariance of an estimate split by the standard deviations of independent priors, by name, and the covariance of a joint one.

    All in natural units; parameters that were held have their prior variance as their own, as fits store them.
    """
    every = estimate.parameters
    slopes = every.natural_slope(every.coordinates())
    whole = slopes[:, None] * estimate.covariance * slopes
    rows = [every.index(name) if name in every else -1 for name in names]
    covariance = np.zeros((len(names), len(names)))
    own = [k for k, row in enumerate(rows) if row >= 0]
    covariance[np.ix_(own, own)] = whole[np.ix_([rows[k] for k in own], [rows[k] for k in own])]
    held = [
        name
        for k, name in enumerate(names)
        if rows[k] >= 0
        and not estimate.identifiable[rows[k]]
        and covariance[k, k] > 0
        and name not in joint[0]
    ]
    by_held = covariance[:, [names.index(name) for name in held]]
    by_held = by_held / np.sqrt([covariance[names.index(name), names.index(name)] for name in held])
    # held parameters are not updated by the measurements, the others are: given those, their covariance is that of a posterior
    inside = covariance - by_held @ by_held.T
    varied = [name for k, name in enumerate(names) if inside[k, k] > 0 and name in prior and name not in held]
    by_prior = inside[:, [names.index(name) for name in varied]] / np.array([prior[name] for name in varied])
    together = [name for name in joint[0] if name in names and name in every]
    at = [list(joint[0]).index(name) for name in together]
    root = np.linalg.cholesky(joint[1][np.ix_(at, at)])
    by_joint = np.linalg.solve(root, inside[[names.index(name) for name in together]]).T
    known = np.hstack([by_held, by_prior, by_joint])
    noise = covariance - known @ known.T
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(noise / np.outer(size, size))
    root = size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return SplitCovariance(tuple(names), root @ root.T, known, (*held, *varied, *together))


def difference_of_known(
    first: SplitCovariance, second: SplitCovariance, *, apart: Sequence[str] = ()
) -> np.ndarray:
    """Columns (p, k) of the difference by what is known beforehand: a source that both have counts once, as it moves both.

    Sources that are kept `apart` count for each.
    """
    columns: dict[tuple[str, int], np.ndarray] = {}
    for number, (sign, side) in enumerate(((-1.0, first), (1.0, second))):
        for column, source in zip(side.known.T, side.sources, strict=True):
            place = (source, number if source in apart else 0)
            columns[place] = columns.get(place, np.zeros(len(column))) + sign * column
    return np.column_stack([np.zeros((len(first.names), 0)), *columns.values()])
