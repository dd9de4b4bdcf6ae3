"""Effects of the options of a study on the error of a task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from flexcal.estimation import f_tail
from flexcal.report.results.chance_wording import chance_in_words
from flexcal.report.results.study_coverage import coverage
from flexcal.report.results.study_table import StudyTable

CHANCE = 0.05
"""Probability that any option of a study without effects is said to have one."""
TOGETHER = "all options together"
_BINS, _FEW = 6, 8
"""Bins of an option with more numbers than a few."""
_DRAWS_A_BIN = 3
"""Least number of draws in a bin of an option whose values are drawn together with those of others."""
_SMALLEST = 1e-9
"""Least error, mm, of which the logarithm is taken."""
_LEAST_SHARE = 0.01
_EQUAL = 1e-20
"""Share of the variance below which a mean square is rounding."""


def option_effects(table: StudyTable) -> list[dict[str, Any]]:
    """Effect of every option on the logarithm of the 90th percentile of a task's errors, surest effects first.

    `share` is that of the variance between tasks which the levels of the option explain (ε² of Kelley 1935, an adjusted ratio; an option
    that has no effect has about 0), without interactions. `p` is the probability that an option without effect explains as much, None where
    seeds or draws are too few; `by_chance` whether the effect may be chance: p is above 5 % over the number of options (Bonferroni), or is
    None. `levels` are the values with numbers of tasks, medians, and the coverage where the truth is known. Several options have a last
    entry for all of their combinations, without levels: effects of single options and interactions.
    """
    values = table.numbers(f"{table.error}.p90_mm")
    usable = np.isfinite(values) & (values > _SMALLEST)
    log = np.log(np.where(usable, values, 1.0))
    seeds = table.combinations(("seed", "resample"))
    found = []
    for name in table.options:
        labels, order = _levels(table, name)
        rows = usable & (labels >= 0)
        levels = [
            {
                "value": label,
                "tasks": int((labels == number).sum()),
                "median_mm": _median(values[usable & (labels == number)]),
                "coverage": coverage(table, labels == number)["share"] if table.has_truth else None,
            }
            for number, label in enumerate(order)
        ]
        share = explained_share(log[rows], labels[rows])
        p = effect_probability(
            log[rows],
            labels[rows],
            _units(table, name)[rows],
            seeds[rows],
            drawn=name in table.drawn_together,
        )
        found.append({"option": name.removeprefix("option."), "share": share, "p": p, "levels": levels})
    found.sort(key=lambda item: (1.0 if item["p"] is None else item["p"], -(item["share"] or 0.0)))
    if len(found) > 1 and not table.drawn_together:
        cells = table.combinations(table.options)[usable]
        share = explained_share(log[usable], cells)
        p = effect_probability(log[usable], cells, cells, seeds[usable])
        found.append({"option": TOGETHER, "share": share, "p": p, "levels": []})
    for item in found:
        item["by_chance"] = item["p"] is None or item["p"] > CHANCE / len(found)
    return found


def effect_sentence(item: Mapping[str, Any]) -> str:
    """What a study tells of the effect of an option."""
    name, p = item["option"], item["p"]
    if item["levels"] and sum(level["median_mm"] is not None for level in item["levels"]) < 2:
        return f"{name}: fewer than two of its values have results"
    if p is None:
        return f"{name}: too few seeds, draws or data sets to tell an effect from chance"
    if item["by_chance"]:
        return f"{name}: no effect of its own beyond chance ({chance_in_words(p)})"
    share = "less than 1" if item["share"] < _LEAST_SHARE else f"{100 * item['share']:.0f}"
    return f"{name} explain{'' if name == TOGETHER else 's'} {share} % of the variance between tasks ({chance_in_words(p)})"


def explained_share(values: np.ndarray, labels: np.ndarray) -> float | None:
    """Share of the variance of values (N,) between groups of equal labels, adjusted for chance (Kelley's ε²); None for too few."""
    groups = np.unique(labels)
    freedom = len(values) - len(groups)
    if len(groups) < 2 or freedom < 1:
        return None
    total = values.var(ddof=1)
    within = sum(float(((values[labels == g] - values[labels == g].mean()) ** 2).sum()) for g in groups)
    return max(0.0, float(1 - within / freedom / total)) if total > 0 else 0.0


def effect_probability(
    values: np.ndarray, labels: np.ndarray, units: np.ndarray, seeds: np.ndarray, *, drawn: bool = False
) -> float | None:
    """Probability of as large differences between the levels of an option without effect; None where too few units or seeds tell.

    Seeds are independent of each other, and so are units, of which each has one level: values of the option, or draws of several options.
    Means of units by seeds make a table of two ways. The mean square between levels is compared with that of levels by seeds, and, with
    several units in a level, plus that between them (Satterthwaite 1946, with approximate degrees of freedom).

    Parameters
    ----------
    values : ndarray
        Results (N,) of tasks.
    labels, units, seeds : ndarray
        Numbers (N,) of the level, of the unit and of the seed of each.
    drawn : bool
        Whether units of one level differ in more than the option, so that only several of them tell.
    """
    means, names = _complete(values, units, seeds)
    first = np.unique(units, return_index=True)[1]
    level = labels[first][names]
    groups, sizes = np.unique(level, return_counts=True)
    kinds, count, trials = len(groups), *means.shape
    if kinds < 2 or trials < 2 or (drawn and count == kinds):
        return None
    by_level = np.array([means[level == g].mean(axis=0) for g in groups])
    centre = np.average(by_level, axis=0, weights=sizes)
    between = by_level.mean(axis=1) - centre.mean()
    effect = trials * float((sizes * between**2).sum()) / (kinds - 1)
    if effect <= _EQUAL * values.var():
        return 1.0
    apart = by_level - centre - between[:, None]
    freedoms = [(kinds - 1.0) * (trials - 1)]
    squares = [float((sizes[:, None] * apart**2).sum()) / freedoms[0]]
    if count > kinds:
        within = means.mean(axis=1) - by_level.mean(axis=1)[np.searchsorted(groups, level)]
        freedoms.append(float(count - kinds))
        squares.append(trials * float((within**2).sum()) / freedoms[1])
    error = sum(squares)
    if error <= 0:
        return None
    freedom = error**2 / sum(square**2 / f for square, f in zip(squares, freedoms, strict=True))
    return float(f_tail(kinds - 1, freedom, effect / error))


def _complete(values: np.ndarray, units: np.ndarray, seeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means (U, S) of units by seeds, and the places (U,) of these units among all, without units and seeds that lack tasks.

    What lacks the largest share of its tasks is left out first.
    """
    names, row = np.unique(units, return_inverse=True)
    columns, column = np.unique(seeds, return_inverse=True)
    counts, sums = np.zeros((2, len(names), len(columns)))
    np.add.at(counts, (row, column), 1.0)
    np.add.at(sums, (row, column), values)
    missing = counts < counts.max(initial=1.0)
    rows, kept = np.arange(len(names)), np.arange(len(columns))
    while (lacking := missing[np.ix_(rows, kept)]).any():
        by_row, by_column = lacking.mean(axis=1), lacking.mean(axis=0)
        if by_row.max() >= by_column.max():
            rows = np.delete(rows, by_row.argmax())
        else:
            kept = np.delete(kept, by_column.argmax())
    grid = np.ix_(rows, kept)
    return sums[grid] / np.maximum(counts[grid], 1.0), rows


def study_level_rows(table: StudyTable, name: str) -> list[tuple[Any, np.ndarray]]:
    """Levels of the column of an option, and the mask (N,) of the rows of each."""
    labels, order = _levels(table, name)
    return [(label, labels == number) for number, label in enumerate(order)]


def _levels(table: StudyTable, name: str) -> tuple[np.ndarray, Sequence[Any]]:
    """Number (N,) of the level of each row, -1 for none, and the levels: values of the option, or bins of equally many."""
    given = list(dict.fromkeys(value for value in table.values(name) if value is not None))
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in given)
    most, bins = _FEW, _BINS
    if name in table.drawn_together:
        most = len(np.unique(_units(table, name))) // _DRAWS_A_BIN
        bins = min(_BINS, most)
    if not numeric or len(given) <= most or bins < 2:
        numbers = {value: k for k, value in enumerate(sorted(given) if numeric else given)}
        return np.array([numbers.get(value, -1) for value in table.values(name)], dtype=int), list(numbers)
    values = table.numbers(name)
    edges = np.unique(np.quantile(values[np.isfinite(values)], np.linspace(0, 1, bins + 1)))
    binned = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    labels = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(edges)]
    return np.where(np.isfinite(values), binned, -1), labels


def _units(table: StudyTable, name: str) -> np.ndarray:
    """Number (N,) of the value of an option, or of the draw where its values are drawn together with those of others."""
    together = table.drawn_together
    return table.combinations(together if name in together else (name,))


def _median(values: np.ndarray) -> float | None:
    return float(np.median(values)) if len(values) else None
