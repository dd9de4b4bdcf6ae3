"""Residuals against measuring order, time or temperature."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, INK
from flexcal.units import MILLIMETRE

_WINDOW = 25


def residual_trend(
    values: np.ndarray, residuals: np.ndarray, title: str, label: str = "measured minus predicted"
) -> go.Figure:
    """Components x, y, z (mm) of residuals (N, 3) m, what the `label` says, against `values` (N,), with a running mean of 25 neighbours."""
    figure = panels(3, 1, 500, ["x", "y", "z"], row_gap=0.08)
    order = np.argsort(values, kind="stable")
    values, residuals = values[order], residuals[order]
    largest = 1.08 * float(np.abs(residuals).max(initial=1e-9)) / MILLIMETRE
    window = min(_WINDOW, max(1, len(residuals) // 4))
    kernel = np.full(window, 1 / window)
    for k in range(3):
        components = residuals[:, k] / MILLIMETRE
        figure.add_trace(
            go.Scatter(
                x=single(values), y=single(components), mode="markers", name=label,
                marker={"color": ELASTIC, "size": 4, "opacity": 0.6}, legendgroup="a", showlegend=k == 0,
                hovertemplate="%{x}: %{y:+.3f} mm",
            ), row=k + 1, col=1,
        )  # fmt: skip
        figure.add_trace(
            go.Scatter(
                x=single(np.convolve(values, kernel, mode="valid")), y=single(np.convolve(components, kernel, mode="valid")),
                mode="lines", name=f"mean of {window} neighbours",
                line={"color": INK, "width": 1.6}, legendgroup="b", showlegend=k == 0, hoverinfo="skip",
            ), row=k + 1, col=1,
        )  # fmt: skip
        figure.update_xaxes(showticklabels=k == 2, row=k + 1, col=1)
    figure.update_yaxes(range=[-largest, largest], nticks=5)
    figure.update_yaxes(title_text="error / mm", row=2, col=1)
    figure.update_xaxes(title_text=title, row=3, col=1)
    return figure
