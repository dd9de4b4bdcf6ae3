"""What each further term of the geometric model gains on poses left out of the fit."""

from __future__ import annotations

import plotly.graph_objects as go

from flexcal.calibration import TermSelection
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, NOMINAL, PAGE
from flexcal.units import MILLIMETRE


def term_scores(selection: TermSelection) -> go.Figure:
    """Mean error (mm) on left-out poses by set of terms, for folds contiguous in measuring order and in the workspace."""
    labels = step_labels(selection)
    figure = canvas(120 + 46 * len(labels))
    in_order = [order / MILLIMETRE for _, order, _ in selection.table]
    in_place = [place / MILLIMETRE for _, _, place in selection.table]
    for name, values, colour in (
        ("left out by place in the workspace", in_place, ELASTIC),
        ("left out by measuring order", in_order, NOMINAL),
    ):
        figure.add_trace(
            go.Bar(
                x=single(values), y=labels, orientation="h", name=name, marker={"color": colour},
                text=[f"{v:.4f}" for v in values], textposition="inside", insidetextanchor="end", constraintext="none",
                textfont={"size": 11, "color": PAGE}, hovertemplate="%{y}: %{x:.4f} mm",
            )
        )  # fmt: skip
    figure.update_layout(bargap=0.3, bargroupgap=0.08, barmode="group")
    figure.update_xaxes(title_text="mean error on left-out poses / mm", rangemode="tozero")
    figure.update_yaxes(autorange="reversed", ticks="")
    return figure


def step_labels(selection: TermSelection) -> list[str]:
    """A label for each row of the selection's table: the terms it starts with, then what each step adds."""
    labels = []
    for number, (terms, *_) in enumerate(selection.table):
        labels.append(" + ".join(terms) if number == 0 else f"+ {terms[-1].replace('_', ' ')}")
    return labels
