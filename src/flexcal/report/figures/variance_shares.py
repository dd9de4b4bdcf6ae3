"""Error sources: reduction of the error variance by kind of parameter."""

from __future__ import annotations

from collections.abc import Mapping

import plotly.graph_objects as go

from flexcal.report.figures.canvas import canvas
from flexcal.report.palette import ELASTIC, RIGID


def variance_shares(over_all: Mapping[str, float], worst: Mapping[str, float]) -> go.Figure:
    """Shares of the variance (0 to 1) that knowing a kind of parameter would take away, over all poses and at the worst place."""
    figure = canvas(90 + 44 * len(over_all))
    for label, shares, colour in (
        ("everywhere, on average", over_all, ELASTIC),
        ("at the worst place", worst, RIGID),
    ):
        figure.add_trace(
            go.Bar(
                x=[100 * share for share in shares.values()],
                y=list(shares),
                orientation="h",
                name=label,
                marker={"color": colour},
                hovertemplate="%{y}: %{x:.1f} %<extra></extra>",
            )
        )
    figure.update_xaxes(title_text="reduction of the variance if known", ticksuffix=" %", range=[0, 100])
    figure.update_yaxes(autorange="reversed")
    return figure
