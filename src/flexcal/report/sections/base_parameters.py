"""The base parameters, their standard deviations and correlations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexcal.estimation import Estimate
from flexcal.report.figures import correlation_map
from flexcal.report.layout import NOTHING, Block, FigureBlock, Section, Table, Text, significant

_STRONGEST = 10


def base_parameters_section(results: Mapping[str, Any], estimate: Estimate) -> Section:
    """All of them, the essential ones, and the correlations of their errors."""
    base, essential = results["base_parameters"], results["essential_parameters"]
    stay, error = len(essential["parameters"]), essential["error_percent"]
    unseen = error["held_out"]
    words = (
        f"{stay} of them are essential: with all others zero, the relative torque error is {significant(error['train'], 3)} % "
        f"instead of {significant(results['error_percent']['train'], 3)} %"
        + (f", and {significant(unseen, 3)} % on data outside the fit." if unseen is not None else ".")
    )
    notes = tuple(f"{note[0].upper()}{note[1:]}." for note in results.get("notes", ()))
    blocks: list[Block] = [Text((words, *notes)), _table(base)]
    names, correlation = base_correlation(base, estimate)
    if len(names) > 1:
        blocks += [_map(names, correlation), _strongest(names, correlation)]
    return Section(
        "base-parameters",
        "Base parameters",
        "Torques depend on the links only through combinations of their masses, first moments and inertias: the base parameters. A "
        "single mass in them is not identifiable by itself.",
        tuple(blocks),
    )


def base_correlation(
    base: Sequence[Mapping[str, Any]], estimate: Estimate
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (k) and correlation (k, k) of the base parameters that are determined, from the covariance of the estimate."""
    names = tuple(row["kept"] for row in base if row["std"])
    at = [estimate.parameters.index(name) for name in names]
    covariance = estimate.covariance[np.ix_(at, at)]
    std = np.sqrt(np.diag(covariance))
    return names, covariance / np.outer(std, std)


def _table(base: Sequence[Mapping[str, Any]]) -> Table:
    rows: list[tuple[str | None, ...]] = []
    for row in base:
        cells: tuple[str | None, ...] = ("not determined by these data", None, None)
        if row["std"] is not None:
            cells = (
                significant(row["estimate"]),
                significant(row["std"], 2),
                significant(row["std_percent"], 2),
            )
        kept = NOTHING if row["essential"] is None else significant(row["essential"])
        rows.append((row["name"], row["unit"], *cells, kept))
    return Table(
        "table-base",
        f"All {len(rows)} base parameters",
        ("base parameter", "unit", "estimate", "std", "std / %", "if essential alone"),
        tuple(rows),
        "The last column has the value where only essential parameters are kept, and a dash where this one is left out.",
        text_columns=(1,),
    )


def _map(names: tuple[str, ...], correlation: np.ndarray) -> FigureBlock:
    return FigureBlock(
        "figure-correlation",
        "Correlation of the base parameters",
        correlation_map(names, correlation),
        "Correlation coefficients of the estimates: blue is positive, red is negative. Pale pairs are well separated by the motion.",
        f"Correlations of {len(names)} base parameters; the strongest are in the table below.",
    )


def _strongest(names: tuple[str, ...], correlation: np.ndarray) -> Table:
    first, second = np.triu_indices(len(names), 1)
    order = np.argsort(-np.abs(correlation[first, second]))[:_STRONGEST]
    rows = tuple(
        (names[first[k]], names[second[k]], f"{correlation[first[k], second[k]]:+.3f}".replace("-", "−"))
        for k in order
    )
    return Table(
        "table-correlation",
        "Most correlated pairs",
        ("base parameter", "and", "correlation"),
        rows,
        "A trajectory that excites the two independently would separate them.",
        text_columns=(1,),
    )
