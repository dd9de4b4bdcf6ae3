"""Cross-validation errors of sets of terms of the geometric model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.calibration import ConsideredTerm
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, INK, NOMINAL, PAGE
from flexcal.units import MILLIMETRE


def term_scores(rows: Sequence[ConsideredTerm], by: str = "folds") -> go.Figure:
    """Mean error (mm) on left-out poses by term: of whole "folds" in measuring order and in the workspace, or of single "poses"."""
    rows = [row for row in rows if np.isfinite(row.order)]
    labels = [term_label(row) for row in rows]
    figure = canvas(120 + 46 * len(labels))
    series = {
        "left out by place in the workspace": ([row.workspace for row in rows], ELASTIC),
        "left out by measuring order": ([row.order for row in rows], NOMINAL),
    }
    if by == "poses":
        series = {"left out one by one": ([row.single for row in rows], ELASTIC)}
    for name, (values, colour) in series.items():
        figure.add_trace(
            go.Bar(
                x=single(np.array(values) / MILLIMETRE), y=labels, orientation="h", name=name, marker={"color": colour},
                text=[f"{v / MILLIMETRE:.4f}" for v in values], textposition="auto", insidetextanchor="end", textangle=0,
                insidetextfont={"size": 11, "color": PAGE}, outsidetextfont={"size": 11, "color": INK}, hovertemplate="%{y}: %{x:.4f} mm",
            )
        )  # fmt: skip
    figure.update_layout(bargap=0.3, bargroupgap=0.08, barmode="group")
    figure.update_xaxes(title_text="mean error on left-out poses / mm", rangemode="tozero")
    figure.update_yaxes(autorange="reversed", ticks="")
    return figure


def term_label(row: ConsideredTerm) -> str:
    """The base terms, or what a term adds to them."""
    if row.term is None:
        return " + ".join(row.terms)
    return f"{'+ ' if row.taken else 'left: '}{row.term.replace('_', ' ')}"
