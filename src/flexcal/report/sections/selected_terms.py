"""Selected terms beyond lengths and angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.calibration.term_selection import TermComparison
from flexcal.report.figures import term_label, term_scores
from flexcal.report.layout import NOTHING, FigureBlock, Section, Table
from flexcal.units import MILLIMETRE


def terms_section(considered: Sequence[TermComparison], by: str) -> Section:
    """Every term that was considered, as a table, and what the terms gain, as a figure; `by` says what was left out."""
    rows = []
    for row in considered:
        errors = {"poses": (row.single,), "places": (row.order,)}.get(by, (row.order, row.workspace))
        bic = f"{row.bic:+.0f}".replace("-", "−") if row.term and np.isfinite(row.bic) else NOTHING
        verdict = "" if row.term is None else f"{'taken' if row.taken else 'left'}: {row.reason}"
        rows.append(
            (term_label(row).removeprefix("left: "), *(_millimetres(e) for e in errors), bic, verdict)
        )
    out = _LEFT_OUT[by][0]
    shown = [row for row in considered if row.taken or row.term is None or "." not in row.term]
    return Section(
        "terms",
        "Which terms the data support",
        "Compliance under gravity (of joints about their axes, and lateral, which tilts the axes), backlash and transmission errors are "
        "added one by one. A term is taken where it lowers the mean error at poses left out of the fit by more than its standard error, "
        "lowers the Bayesian information criterion (BIC) and does not raise the largest error at a left-out pose. "
        + _LEFT_OUT[by][1]
        + " Transmission errors, taken here or not, are random effects of the calibration: waves in the position of every revolute joint, "
        "with one variance that is estimated from the residuals.",
        (
            Table(
                "table-terms",
                "Terms considered",
                ("term", *out, "change of BIC", "verdict"),
                tuple(rows),
                "Terms that were left are compared with those chosen when they were tried last.",
                text_columns=(2 + len(out),),
            ),
            FigureBlock(
                "figure-terms",
                "Mean error at left-out poses by term",
                term_scores(shown, by),
                "Shorter bars are better. Bars of terms that were left show the terms chosen by then with that one added.",
                "Bars of the numbers in the table above.",
            ),
        ),
    )


_LEFT_OUT = {
    "poses": (("left out one by one / mm",), "Poses are few, so they are left out one by one."),
    "places": (
        ("left out by place / mm",),
        "Each place of the fixture is left out with all its poses: the rest of them would tell where it stands.",
    ),
    "folds": (
        ("left out by order / mm", "left out by place / mm"),
        "Neighbours in time and neighbours in space are left out together: left out at random, a pose would have near twins in the fit, "
        "and every term would be flattered.",
    ),
}
"""Headings and a sentence by what was left out."""


def _millimetres(value: float) -> str:
    return f"{value / MILLIMETRE:.4f}" if np.isfinite(value) else NOTHING
