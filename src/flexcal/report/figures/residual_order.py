"""Residuals in the order of measuring: drift, warm-up and bumps show here."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, INK
from flexcal.units import MILLIMETRE

_WINDOW = 25


def residual_order(residuals: np.ndarray) -> go.Figure:
    """Components x, y, z (mm) of residuals (N, 3) m against the row number, with a running mean of 25 rows."""
    figure = panels(3, 1, 500, ["x", "y", "z"], row_gap=0.08)
    rows = np.arange(1, len(residuals) + 1)
    largest = 1.08 * float(np.abs(residuals).max(initial=1e-9)) / MILLIMETRE
    window = min(_WINDOW, max(1, len(residuals) // 4))
    for k in range(3):
        values = residuals[:, k] / MILLIMETRE
        figure.add_trace(
            go.Scatter(
                x=single(rows), y=single(values), mode="markers", name="measured minus predicted",
                marker={"color": ELASTIC, "size": 4, "opacity": 0.6}, legendgroup="a", showlegend=k == 0,
                hovertemplate="row %{x}: %{y:+.3f} mm",
            ), row=k + 1, col=1,
        )  # fmt: skip
        smooth = np.convolve(values, np.full(window, 1 / window), mode="valid")
        figure.add_trace(
            go.Scatter(
                x=single(rows[window - 1 :] - (window - 1) / 2), y=single(smooth), mode="lines", name=f"mean of {window} rows",
                line={"color": INK, "width": 1.6}, legendgroup="b", showlegend=k == 0, hoverinfo="skip",
            ), row=k + 1, col=1,
        )  # fmt: skip
        figure.update_xaxes(showticklabels=k == 2, row=k + 1, col=1)
    figure.update_yaxes(range=[-largest, largest], nticks=5)
    figure.update_yaxes(title_text="error / mm", row=2, col=1)
    figure.update_xaxes(title_text="measurement, in order", row=3, col=1)
    return figure
