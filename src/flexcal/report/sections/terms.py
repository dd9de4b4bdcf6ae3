"""Which terms beyond lengths and angles the data support."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.report.figures.term_scores import TermStep, step_labels, term_scores
from flexcal.report.page import FigureBlock, Section, Table
from flexcal.units import MILLIMETRE


def terms_section(steps: Sequence[TermStep], chosen: Sequence[str]) -> Section:
    """The steps of the selection that ended with the `chosen` terms, as a table and a figure."""
    rows = []
    for label, step in zip(step_labels(steps), steps, strict=True):
        kept = "yes" if set(step.terms) <= set(chosen) else "no, not clear enough"
        rows.append((label, f"{step.order / MILLIMETRE:.4f}", f"{step.place / MILLIMETRE:.4f}", kept))
    return Section(
        "terms",
        "Which terms the data support",
        "Compliance under gravity, play in the gears and errors of the transmissions are added one by one, and kept only where they lower "
        "the error at poses that were left out of the fit, both when neighbours in time and when neighbours in space are left out "
        "together. Leaving out poses at random would flatter every term: a left-out pose would have near twins in the fit.",
        (
            Table(
                "table-terms",
                "Mean error on left-out poses",
                ("terms", "left out by order / mm", "left out by place / mm", "kept"),
                tuple(rows),
                text_columns=(3,),
            ),
            FigureBlock(
                "figure-terms",
                "What each term gains",
                term_scores(steps),
                "Shorter bars are better. The last step is the best of those that were tried next; it is kept only where both bars are "
                "shorter by more than one standard error.",
                "Bars of the numbers in the table above.",
            ),
        ),
    )
