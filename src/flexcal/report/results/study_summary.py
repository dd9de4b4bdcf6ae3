"""Statistics of a study: distributions, coverage of intervals, effects of options, agreement of resamples."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.report.results.study_coverage import coverage
from flexcal.report.results.study_effects import option_effects
from flexcal.report.results.study_table import StudyTable

ALL_BELOW = 40
"""Number of values from which some are outside their 2.5 % and 97.5 % quantiles."""
ABOUT_ALIKE = 1.25
"""Ratio of two spreads that are about alike."""
_STATISTICS = ("mean_mm", "p90_mm", "max_mm")
FEWEST_RESAMPLES = 8
"""Least number of resamples that tell a spread."""
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
        "effects": option_effects(table),
        "resampling": resampling(table),
        "failures": failures(table),
        "seconds": quantiles(table.numbers("seconds")),
    }


def quantiles(values: np.ndarray) -> dict[str, float | int | None]:
    """Number, mean, median, and the 2.5 %, 90 % and 97.5 % quantiles of the finite values.

    At least 95 % of the values are between the outer ones, which are the least and the largest value of fewer than `ALL_BELOW`.
    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return {"tasks": 0, "mean": None, "median": None, "low": None, "p90": None, "high": None}
    low, high = np.quantile(finite, [0.025, 0.975], method="inverted_cdf")
    middle, p90 = np.quantile(finite, [0.5, 0.9])
    return {
        "tasks": len(finite),
        "mean": float(finite.mean()),
        "median": float(middle),
        "low": float(low),
        "p90": float(p90),
        "high": float(high),
    }


def resampling(table: StudyTable) -> dict[str, Any] | None:
    """Spread of every parameter over resampled data sets beside its standard deviation; None where data were not resampled.

    Bootstrap: standard deviation of the estimates; groups left out: the jackknife's √((G − 1)/G Σ (θ − mean)²) (Efron and Tibshirani 1993,
    chapter 11). `ratio` is the spread over the stated standard deviation, and of all parameters the median; `expected` is the ratio where
    the stated one is right. `ratio_low` is the lower limit of the true ratio over the expected one, where the spread over so few data sets
    is known from chi-square only: all limits together hold with 99 % (Bonferroni); `surely_larger` names those where it is above 1.25, the
    largest ratio first. Components of the scatter have none: how they share it among them is chance, and some end at zero; nor have fewer
    than 8 data sets. Nothing where options differ, as the spread is theirs too.
    """
    names = np.array(table.values("resample"), dtype=object)
    drawn = np.array([isinstance(n, str) and n not in ("", "all") for n in names], dtype=bool)
    if not drawn.any() or table.options:
        return None
    kind = "bootstrap" if str(names[drawn][0]).startswith("bootstrap ") else "jackknife"
    expected = 1.0 if kind == "bootstrap" else _jackknife_ratio(table, drawn)
    parameters: dict[str, dict[str, Any]] = {}
    freedoms: dict[str, float] = {}
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
            "ratio_low": None,
        }
        if stated > 0 and len(own) >= FEWEST_RESAMPLES and not name.startswith("scatter."):
            freedoms[name] = _freedom(own)
    for name, freedom in freedoms.items():
        low = parameters[name]["ratio"] * _surely(freedom, len(freedoms)) / expected
        parameters[name]["ratio_low"] = low
    ratios = [item["ratio"] for item in parameters.values() if item["ratio"] is not None]
    larger = [name for name, item in parameters.items() if (item["ratio_low"] or 0.0) > ABOUT_ALIKE]
    return {
        "kind": kind,
        "resamples": int(drawn.sum()),
        "ratio": _median(ratios),
        "expected": expected,
        "surely_larger": sorted(larger, key=lambda name: -parameters[name]["ratio"]),
        "parameters": parameters,
    }


def _jackknife_ratio(table: StudyTable, left_out: np.ndarray) -> float:
    """Spread over the standard deviation that a jackknife has of sound data, in which what is left out errs by more than one noise.

    Measurements of variance σ² that a fit of p parameters to others with f degrees of freedom predicts have errors of variance
    σ² (1 + p / (f − 1)), where both are drawn alike, and the differences of the estimates go with these.
    """
    freedom, rank = table.numbers("freedom")[left_out], table.numbers("rank")[left_out]
    known = freedom > 1
    return float(np.sqrt(np.median(1 + rank[known] / (freedom[known] - 1)))) if known.any() else 1.0


def _freedom(values: np.ndarray) -> float:
    """Degrees of freedom of the variance of values (n,): n − 1 if normal, fewer if some are far out, by their kurtosis κ: 2 n / (κ − 1)."""
    squares = (values - values.mean()) ** 2
    if not squares.any():
        return len(values) - 1.0
    kurtosis = float((squares**2).mean() / squares.mean() ** 2)
    return min(len(values) - 1.0, 2 * len(values) / max(kurtosis - 1, 1e-9))


def _surely(freedom: float, parameters: int) -> float:
    """Lower limit of a true spread, of one of many parameters, over one that is known with so many degrees of freedom."""
    from scipy.special import chdtri

    return float(np.sqrt(freedom / chdtri(freedom, _DOUBT / parameters)))


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def failures(table: StudyTable) -> list[dict[str, Any]]:
    """Messages of failed tasks, the most frequent first, with the number of tasks and the first of them."""
    messages, codes, numbers = table.values("error"), table.values("error_code"), table.values("number")
    told = Counter(message for message in messages if message is not None)
    return [
        {"error": message, "code": codes[messages.index(message)], "tasks": count}
        | {"first": numbers[messages.index(message)]}
        for message, count in told.most_common()
    ]


def share_between(item: Mapping[str, Any]) -> str:
    """Which tasks have values between `low` and `high` of `quantiles`."""
    return "all" if item["tasks"] < ALL_BELOW else "95 %"
