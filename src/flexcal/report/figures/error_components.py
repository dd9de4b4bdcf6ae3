"""Fig. 12: residuals at every calibration pose, by coordinate."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.data import PoseSet
from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, QUIET
from flexcal.units import MILLIMETRE


def error_components(poses: PoseSet, residuals: np.ndarray) -> go.Figure:
    """Components x, y, z of the residuals (N, 3) m in millimetres, one panel each, with the instrument's ± 2σ around them."""
    figure = panels(3, 1, 470, ["x", "y", "z"], row_gap=0.08)
    noise = 2 * poses.sigma / MILLIMETRE
    largest = 1.1 * max(float(np.abs(residuals).max(initial=1e-9)) / MILLIMETRE, float(noise.max()))
    for k in range(3):
        for sign in (1, -1):
            figure.add_trace(
                go.Scatter(
                    x=single(poses.pose),
                    y=single(sign * noise[:, k]),
                    line={"width": 1.2, "dash": "dot", "color": QUIET},
                    mode="lines",
                    name="± 2σ of the instrument",
                    legendgroup="noise",
                    showlegend=k == 0 and sign > 0,
                    hoverinfo="skip",
                ),
                row=k + 1,
                col=1,
            )
        figure.add_trace(
            go.Bar(
                x=single(poses.pose),
                y=single(residuals[:, k] / MILLIMETRE),
                marker={"color": ELASTIC, "line": {"width": 0}},
                width=0.6,
                name="measured minus predicted",
                legendgroup="residual",
                showlegend=k == 0,
                hovertemplate="pose %{x}: %{y:+.3f} mm",
            ),
            row=k + 1,
            col=1,
        )
        figure.update_xaxes(showticklabels=k == 2, row=k + 1, col=1)
    figure.update_yaxes(range=[-largest, largest], nticks=5)
    figure.update_yaxes(title_text="error / mm", row=2, col=1)
    figure.update_xaxes(title_text="calibration pose", row=3, col=1)
    return figure
