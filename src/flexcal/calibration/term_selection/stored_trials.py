"""Conversion of considered terms to and from `term_selection` of results.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from flexcal.calibration.term_selection.trials import TermComparison
from flexcal.units import MILLIMETRE


def considered_document(row: TermComparison) -> dict[str, Any]:
    """Document of a considered term in results.json; null for values that were not computed."""
    return {
        "term": row.term,
        "terms": list(row.terms),
        "taken": row.taken,
        "reason": row.reason,
        "order_mm": _known(row.order / MILLIMETRE),
        "workspace_mm": _known(row.workspace / MILLIMETRE),
        "single_mm": _known(row.single / MILLIMETRE),
        "largest_mm": _known(row.largest / MILLIMETRE),
        "bic_difference": _known(row.bic),
    }


def considered_terms(results: Mapping[str, Any]) -> tuple[TermComparison, ...]:
    """Considered terms read from results.json; empty if the terms were given, or the poses too few."""
    return tuple(_considered(row) for row in results["term_selection"])


def _considered(row: Mapping[str, Any]) -> TermComparison:
    order, workspace, single, largest = (
        _number(row[f"{key}_mm"]) * MILLIMETRE for key in ("order", "workspace", "single", "largest")
    )
    return TermComparison(
        row["term"],
        tuple(row["terms"]),
        order,
        workspace,
        single,
        largest,
        _number(row["bic_difference"]),
        row["taken"],
        row["reason"],
    )


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _number(value: float | None) -> float:
    return math.nan if value is None else value
