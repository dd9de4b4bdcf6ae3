"""Largest standard deviation of a stiffness against the number of poses."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import AXIS, ELASTIC, NOMINAL


def poses_against_std(curve: np.ndarray, planned: int) -> go.Figure:
    """Largest predicted standard deviation of a stiffness (per cent) against the number of poses; `curve` (3, K): poses, chosen, random."""
    counts, chosen, random = curve
    figure = canvas(320)
    for name, values, colour in (("at random", random, NOMINAL), ("chosen one by one", chosen, ELASTIC)):
        figure.add_trace(
            go.Scatter(
                x=single(counts),
                y=single(100 * values),
                name=name,
                mode="lines+markers",
                line={"color": colour, "width": 2},
                hovertemplate="%{x} poses: %{y:.2f} %",
            )
        )
    figure.add_vline(x=planned, line={"color": AXIS, "width": 1.5, "dash": "dot"})
    ticks = [0.5, 1, 2, 5, 10, 20, 50, 100]
    figure.update_yaxes(type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks])
    figure.update_yaxes(title_text="largest standard deviation of a stiffness / %")
    figure.update_xaxes(title_text="poses", dtick=1)
    return figure
