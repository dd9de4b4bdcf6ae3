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
    and the remainder of the noise.
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
    stds = {name: np.sqrt(covariance[k, k]) for k, name in enumerate(names) if name in held}
    varied = [name for k, name in enumerate(names) if covariance[k, k] > 0]
    stds |= {name: std for name, std in prior.items() if name in varied}
    blocks: list[np.ndarray] = [
        covariance[:, [names.index(name) for name in stds]] / np.array(list(stds.values()))
    ]
    sources = list(stds)
    together = [name for name in joint[0] if name in names and name in every]
    if together:
        at = [list(joint[0]).index(name) for name in together]
        root = np.linalg.cholesky(joint[1][np.ix_(at, at)])
        blocks.append(np.linalg.solve(root, covariance[[names.index(name) for name in together]]).T)
        sources += together
    known = np.concatenate(blocks, axis=1)
    values, vectors = np.linalg.eigh(
        _scaled(covariance - known @ known.T, np.sqrt(np.maximum(np.diag(covariance), 1e-300)))
    )
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))[:, None]
    root = scale * vectors * np.sqrt(np.maximum(values, 0.0))
    return SplitCovariance(tuple(names), root @ root.T, known, tuple(sources))


def difference_of_known(first: SplitCovariance, second: SplitCovariance) -> np.ndarray:
    """Columns (p, k) of the difference by what is known beforehand: a source that both have counts once, as it moves both."""
    every = list(dict.fromkeys([*first.sources, *second.sources]))
    result = np.zeros((len(first.names), len(every)))
    for sign, side in ((1.0, second), (-1.0, first)):
        for column, source in zip(side.known.T, side.sources, strict=True):
            result[:, every.index(source)] += sign * column
    return result


def _scaled(matrix: np.ndarray, size: np.ndarray) -> np.ndarray:
    return matrix / np.outer(size, size)
