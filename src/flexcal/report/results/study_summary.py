"""Statistics of a study: distributions, coverage of intervals, effects of options, agreement of resamples."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from flexcal.estimation import student_quantile
from flexcal.report.results.study_table import StudyTable

NOMINAL_COVERAGE = 0.95
ABOUT_ALIKE = 1.25
"""Ratio of two spreads that are about alike."""
_NORMAL_QUANTILE = 1.959963984540054
_BINS, _FEW = 6, 8
"""Bins of an option with more numbers than a few."""
_STATISTICS = ("mean_mm", "p90_mm", "max_mm")
_SMALLEST = 1e-9
_DOUBT = 0.01
"""Probability that any of the lower limits of all ratios is above the true one."""


def study_statistics(table: StudyTable) -> dict[str, Any]:
    """Blocks of results.json: `errors`, `coverage`, `effects`, `resampling`, `failures`, `seconds`."""
    return {
        "errors": {
            name: {key: quantiles(table.numbers(f"{name}.{key}")) for key in _STATISTICS}
            for name in table.errors
        },
        "coverage": coverage(table) if table.has_truth else None,
        "effects": effects(table),
        "resampling": resampling(table),
        "failures": failures(table),
        "seconds": quantiles(table.numbers("seconds")),
    }


def quantiles(values: np.ndarray) -> dict[str, float | int | None]:
    """Number, mean, median, and the 2.5 %, 90 % and 97.5 % quantiles of the finite values."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return {"tasks": 0, "mean": None, "median": None, "low": None, "p90": None, "high": None}
    low, middle, p90, high = np.quantile(finite, [0.025, 0.5, 0.9, 0.975])
    return {
        "tasks": len(finite),
        "mean": float(finite.mean()),
        "median": float(middle),
        "low": float(low),
    } | {
        "p90": float(p90),
        "high": float(high),
    }


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
        "ratio": _median(ratios),
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


def effects(table: StudyTable) -> list[dict[str, Any]]:
    """Effect of every option on the logarithm of the 90th percentile of a task's errors.

    `share` is that of the variance between tasks which the levels of the option explain (ε² of Kelley 1935, an adjusted ratio; an option
    that has no effect has about 0), without interactions; `levels` have the median, and the coverage where the truth is known.
    """
    values = table.numbers(f"{table.error}.p90_mm")
    found = []
    for name in table.options:
        labels, order = _levels(table, name)
        usable = np.isfinite(values) & (values > _SMALLEST) & (labels >= 0)
        levels = []
        for number, label in enumerate(order):
            rows = labels == number
            own = values[rows & usable]
            levels.append(
                {
                    "value": label,
                    "tasks": int(rows.sum()),
                    "median_mm": float(np.median(own)) if len(own) else None,
                    "coverage": coverage(table, rows)["share"] if table.has_truth else None,
                }
            )
        share = explained_share(np.log(values[usable]), labels[usable])
        found.append({"option": name.removeprefix("option."), "share": share, "levels": levels})
    return sorted(found, key=lambda item: -(item["share"] or 0.0))


def explained_share(values: np.ndarray, labels: np.ndarray) -> float | None:
    """Share of the variance of values (N,) between groups of equal labels, adjusted for chance (Kelley's ε²); None for too few."""
    groups = np.unique(labels)
    freedom = len(values) - len(groups)
    if len(groups) < 2 or freedom < 1:
        return None
    total = values.var(ddof=1)
    within = sum(float(((values[labels == g] - values[labels == g].mean()) ** 2).sum()) for g in groups)
    return max(0.0, float(1 - within / freedom / total)) if total > 0 else 0.0


def _levels(table: StudyTable, name: str) -> tuple[np.ndarray, Sequence[Any]]:
    """Number (N,) of the level of each row, -1 for none, and the levels: values of the option, or bins of equally many."""
    given = list(dict.fromkeys(value for value in table.values(name) if value is not None))
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in given)
    if not numeric or len(given) <= _FEW:
        numbers = {value: k for k, value in enumerate(sorted(given) if numeric else given)}
        return np.array([numbers.get(value, -1) for value in table.values(name)], dtype=int), list(numbers)
    values = table.numbers(name)
    edges = np.unique(np.quantile(values[np.isfinite(values)], np.linspace(0, 1, _BINS + 1)))
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    labels = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(edges)]
    return np.where(np.isfinite(values), bins, -1), labels


def resampling(table: StudyTable) -> dict[str, Any] | None:
    """Spread of every parameter over resampled data sets beside its standard deviation; None where data were not resampled.

    Bootstrap: standard deviation of the estimates; groups left out: the jackknife's √((G − 1)/G Σ (θ − mean)²) (Efron and Tibshirani 1993,
    chapter 11). `ratio` is the spread over the stated standard deviation, and of all parameters the median. `ratio_low` is the lower limit
    of the true ratio, where the spread over so few data sets is known from chi-square only: all limits together hold with 99 %
    (Bonferroni); `surely_larger` names those where it is above 1.25, the largest ratio first. Components of the scatter have none: how
    they share it among them is chance, and some end at zero. Nothing where options differ, as the spread is theirs too.
    """
    names = np.array(table.values("resample"), dtype=object)
    drawn = np.array([isinstance(n, str) and n not in ("", "all") for n in names], dtype=bool)
    if not drawn.any() or table.options:
        return None
    kind = "bootstrap" if str(names[drawn][0]).startswith("bootstrap ") else "jackknife"
    parameters: dict[str, dict[str, Any]] = {}
    for name in table.parameters:
        estimate, std = table.numbers(f"{name}.estimate"), table.numbers(f"{name}.std")
        own, whole = estimate[drawn], estimate[names == "all"]
        own = own[np.isfinite(own)]
        if len(own) < 2 or not len(whole) or not np.isfinite(whole[0]):
            continue
        spread = own.std(ddof=1) if kind == "bootstrap" else np.sqrt((len(own) - 1) * own.var())
        stated = float(std[names == "all"][0])
        parameters[name] = {
            "unit": table.units.get(name),
            "estimate": float(whole[0]),
            "std": stated,
            "spread": float(spread),
            "ratio": float(spread / stated) if stated > 0 else None,
            "resamples": len(own),
        }
    judged = [name for name in parameters if not name.startswith("scatter.")]
    for name, item in parameters.items():
        ratio = item["ratio"] if name in judged else None
        item["ratio_low"] = None if ratio is None else _surely(ratio, item["resamples"], len(judged))
    ratios = [item["ratio"] for item in parameters.values() if item["ratio"] is not None]
    larger = [name for name, item in parameters.items() if (item["ratio_low"] or 0.0) > ABOUT_ALIKE]
    return {
        "kind": kind,
        "resamples": int(drawn.sum()),
        "ratio": _median(ratios),
        "surely_larger": sorted(larger, key=lambda name: -parameters[name]["ratio"]),
        "parameters": parameters,
    }


def _surely(ratio: float, resamples: int, parameters: int) -> float:
    """Lower limit of the true ratio of one of many parameters, from the scatter of a spread over so many data sets."""
    from scipy.special import chdtri

    freedom = resamples - 1
    return ratio * float(np.sqrt(freedom / chdtri(freedom, _DOUBT / parameters)))


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def study_level_rows(table: StudyTable, name: str) -> list[tuple[Any, np.ndarray]]:
    """Levels of the column of an option, and the mask (N,) of the rows of each."""
    labels, order = _levels(table, name)
    return [(label, labels == number) for number, label in enumerate(order)]


def failures(table: StudyTable) -> list[dict[str, Any]]:
    """Messages of failed tasks, the most frequent first, with the number of tasks and the first of them."""
    messages, codes, numbers = table.values("error"), table.values("error_code"), table.values("number")
    told = Counter(message for message in messages if message is not None)
    return [
        {"error": message, "code": codes[messages.index(message)], "tasks": count}
        | {"first": numbers[messages.index(message)]}
        for message, count in told.most_common()
    ]
