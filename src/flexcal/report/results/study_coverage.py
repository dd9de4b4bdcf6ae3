"""Coverage of the intervals of a study."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.estimation import student_quantile
from flexcal.report.results.study_table import StudyTable

NOMINAL_COVERAGE = 0.95
_NORMAL_QUANTILE = 1.959963984540054


def binomial_interval(inside: float, count: float) -> tuple[float, float]:
    """95 % interval of a probability from `inside` of `count` independent trials (Clopper and Pearson 1934), also of effective numbers."""
    from scipy.special import betaincinv

    tail = (1 - NOMINAL_COVERAGE) / 2
    low = betaincinv(inside, count - inside + 1, tail) if inside > 0 else 0.0
    high = betaincinv(inside + 1, count - inside, 1 - tail) if inside < count else 1.0
    return float(low), float(high)


def coverage(table: StudyTable, rows: np.ndarray | None = None) -> dict[str, Any]:
    """How often 95 % intervals hold the true value: of every parameter, and of all, with the 95 % intervals of these shares.

    Tasks of one seed share the drawn robot and its noise, as the intervals of one task do: only `seeds` are independent. `ratio` is the
    root mean square of the errors over their stated standard deviations, and of all parameters the median. `rows` (N,) is a mask.
    """
    chosen = np.ones(len(table), bool) if rows is None else rows
    drawn = _drawn_robots(table)
    parameters, held, known = {}, np.zeros(len(table)), np.zeros(len(table))
    for name in table.parameters:
        low, high, truth = (table.numbers(f"{name}.{what}") for what in ("low", "high", "truth"))
        told = np.isfinite(low) & np.isfinite(truth) & chosen
        count = int(told.sum())
        if not count:
            continue
        inside = told & (low <= truth) & (truth <= high)
        held += inside
        known += told
        bounds = _clustered_interval(inside, told, drawn)
        estimate, std = (table.numbers(f"{name}.{what}")[told] for what in ("estimate", "std"))
        apart = (estimate - truth[told])[std > 0] / std[std > 0]
        parameters[name] = {
            "tasks": count,
            "inside": int(inside.sum()),
            "share": float(inside.sum() / count),
        } | {
            "low": bounds[0],
            "high": bounds[1],
            "ratio": float(np.sqrt((apart**2).mean())) if len(apart) else None,
        }
    some = known > 0
    bounds = _clustered_interval(held, known, drawn) if some.any() else None
    ratios = [item["ratio"] for item in parameters.values() if item["ratio"] is not None]
    return {
        "tasks": int(some.sum()),
        "seeds": len(np.unique(drawn[some])),
        "share": float(held.sum() / known.sum()) if some.any() else None,
        "low": None if bounds is None else bounds[0],
        "high": None if bounds is None else bounds[1],
        "ratio": float(np.median(ratios)) if ratios else None,
        "parameters": parameters,
    }


def _drawn_robots(table: StudyTable) -> np.ndarray:
    """Number (N,) of the seed of every task; a task without one is by itself."""
    seeds = [-1 - k if seed is None else seed for k, seed in enumerate(table.values("seed"))]
    return np.unique(seeds, return_inverse=True)[1]


def _clustered_interval(held: np.ndarray, known: np.ndarray, drawn: np.ndarray) -> tuple[float, float]:
    """95 % interval of a share from `held` of `known` trials (N,) of every task, with `drawn` (N,) the number of its seed.

    Clopper and Pearson's for the number of independent trials that the scatter between seeds amounts to (Korn and Graubard 1998); that is
    the number of seeds where all or none are held, and one for one seed.
    """
    known_by_seed = np.bincount(drawn, known)
    some = known_by_seed > 0
    held, known = np.bincount(drawn, held)[some], known_by_seed[some]
    count, total = len(known), known.sum()
    share = held.sum() / total
    if count == 1:
        return binomial_interval(share, 1)
    variance = ((held - share * known) ** 2).sum() * count / (count - 1) / total**2
    trials = share * (1 - share) / variance if variance > 0 else float(count)
    trials = min(
        total, trials * (_NORMAL_QUANTILE / student_quantile(1 - (1 - NOMINAL_COVERAGE) / 2, count - 1)) ** 2
    )
    return binomial_interval(share * trials, trials)
