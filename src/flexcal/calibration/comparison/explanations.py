"""Parameters whose change explains the difference of two calibrations, one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

LEVEL = 0.05
"""Probability of naming a change where there is none."""
_MOST = 6
"""Largest number of explaining parameters."""
ALIKE = 4.0
"""Difference of χ² below which two explanations cannot be told from each other: two standard deviations."""


@dataclass(frozen=True)
class Candidate:
    """Cause of a change: `columns` (m, k) of the whitened difference by its parameters `names`, natural units; `subject` is
    the parameter's name, or that of a point on the tool for its place.
    """

    subject: str
    names: tuple[str, ...]
    columns: np.ndarray


@dataclass(frozen=True)
class Explanation:
    """Change of the parameters `names` by `change`, with standard deviations `std`, natural units, the other explanations given.

    `probability` that chance makes it as large, times the number of candidates (Holm 1979); `alternatives` are subjects that explain the
    difference about as well.
    """

    subject: str
    names: tuple[str, ...]
    change: tuple[float, ...]
    std: tuple[float, ...]
    probability: float
    alternatives: tuple[str, ...]


def explain(
    difference: np.ndarray, candidates: Sequence[Candidate], freedom: float
) -> tuple[Explanation, ...]:
    """Explanations of a whitened `difference` (m,) by forward selection, while what is left is beyond chance.

    Those without which no more than chance is left, because later ones took their place, are left out again. `freedom` are the degrees of
    freedom of the noise. Among candidates that explain about the same, the place of a point on the tool comes first, then joint zeros:
    reflectors and belts slip more often than axes bend.
    """
    chosen: list[Candidate] = []
    chances: list[float] = []
    while len(chosen) < _MOST:
        rest, used = _rest(difference, chosen)
        if chance_of(rest, len(difference) - used, freedom) > LEVEL:
            break
        left = [c for c in candidates if c not in chosen]
        gains = [_gain(difference, chosen, c) for c in left]
        best = max(range(len(left)), key=lambda k: gains[k][0] - 2 * gains[k][1], default=None)
        if best is None:
            break
        alike = [k for k in range(len(left)) if gains[k][0] > gains[best][0] - ALIKE]
        best = min(alike, key=lambda k: (_rank(left[k]), -gains[k][0]))
        chance = min(1.0, len(left) * chance_of(*gains[best], freedom))
        if chance > LEVEL:
            break
        chosen.append(left[best])
        chances.append(chance)
    for item in chosen[:-1]:
        others = [c for c in chosen if c is not item]
        rest, used = _rest(difference, others)
        if chance_of(rest, len(difference) - used, freedom) > LEVEL:
            del chances[chosen.index(item)]
            chosen = others
    return _told(difference, chosen, chances, candidates)


def chance_of(statistic: float, count: int, freedom: float) -> float:
    """Probability that chance makes a sum of squares of `count` whitened values as large, by F where the noise is hardly known."""
    from scipy.stats import chi2, f

    if count <= 0:
        return 1.0
    return float(f.sf(statistic / count, count, freedom) if freedom < 1e4 else chi2.sf(statistic, count))


def _told(
    difference: np.ndarray, chosen: list[Candidate], chances: list[float], candidates: Sequence[Candidate]
) -> tuple[Explanation, ...]:
    if not chosen:
        return ()
    matrix = np.concatenate([c.columns for c in chosen], axis=1)
    scale = np.linalg.norm(matrix, axis=0)
    inverse = np.linalg.pinv(matrix / scale, rcond=1e-6)
    change, std = inverse @ difference / scale, np.linalg.norm(inverse, axis=1) / scale
    whole = _rest(difference, chosen)[0]
    result, start = [], 0
    for item, chance in zip(chosen, chances, strict=True):
        rows = slice(start, start + len(item.names))
        start = rows.stop
        others = [c for c in chosen if c is not item]
        alike = [
            c.subject
            for c in candidates
            if c not in chosen and _rest(difference, [*others, c])[0] < whole + ALIKE
        ]
        result.append(
            Explanation(
                item.subject,
                item.names,
                tuple(change[rows].tolist()),
                tuple(std[rows].tolist()),
                chance,
                tuple(alike),
            )
        )
    return tuple(result)


def _rest(difference: np.ndarray, chosen: Sequence[Candidate]) -> tuple[float, int]:
    """Sum of squares that candidates leave, and their number of independent columns."""
    if not chosen:
        return float(difference @ difference), 0
    matrix = np.concatenate([c.columns for c in chosen], axis=1)
    basis, sizes, _ = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=0), full_matrices=False)
    basis = basis[:, sizes > 1e-6 * sizes[0]]
    left = difference - basis @ (basis.T @ difference)
    return float(left @ left), basis.shape[1]


def _gain(difference: np.ndarray, chosen: list[Candidate], candidate: Candidate) -> tuple[float, int]:
    before, after = _rest(difference, chosen), _rest(difference, [*chosen, candidate])
    return before[0] - after[0], after[1] - before[1]


def _rank(candidate: Candidate) -> int:
    """Rank of a candidate among those that explain the same: points on the tool, joint zeros, others."""
    return (
        0 if candidate.subject not in candidate.names else 1 if candidate.subject.endswith(".offset") else 2
    )


def candidates_of(
    names: Sequence[str], matrix: np.ndarray, points: Mapping[str, Sequence[str]]
) -> list[Candidate]:
    """Each of `names` with its column of `matrix` (m, p), and for each of `points`, by subject, the names of its place together."""
    together = {name for group in points.values() for name in group}
    single = [
        Candidate(name, (name,), matrix[:, [k]]) for k, name in enumerate(names) if name not in together
    ]
    of_points = [
        Candidate(subject, tuple(own), matrix[:, [list(names).index(name) for name in own]])
        for subject, group in points.items()
        if (own := [name for name in group if name in names])
    ]
    return single + of_points
