"""What each further term of the geometric model gains on poses left out of the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import plotly.graph_objects as go

from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, NOMINAL, PAGE
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class TermStep:
    """Mean errors (m) on poses left out, by measuring order and by place, with these terms."""

    terms: tuple[str, ...]
    order: float
    place: float


def term_scores(steps: Sequence[TermStep]) -> go.Figure:
    """Mean error (mm) on left-out poses by set of terms, for folds contiguous in measuring order and in the workspace."""
    labels = step_labels(steps)
    figure = canvas(120 + 46 * len(labels))
    in_order = [step.order / MILLIMETRE for step in steps]
    in_place = [step.place / MILLIMETRE for step in steps]
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


def step_labels(steps: Sequence[TermStep]) -> list[str]:
    """A label for each step of a selection: the terms it starts with, then what each adds."""
    first, *later = steps
    return [" + ".join(first.terms), *(f"+ {step.terms[-1].replace('_', ' ')}" for step in later)]
