"""Fig. 5: measured frequency responses with their noise and distortion levels, pose by pose."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from flexcal.report.figures.canvas import decades, panels, positive, single
from flexcal.report.measured_response import MeasuredResponse
from flexcal.report.palette import ELASTIC, NOMINAL, RIGID

FREQUENCY_TICKS = (1, 3, 10, 30, 100, 300)


def response_levels(responses: Sequence[MeasuredResponse], labels: Sequence[str]) -> go.Figure:
    """Magnitude of every element against frequency, and 1σ of its mean from noise and from nonlinear distortion (eq. 19).

    One pose is shown at a time: traces carry `meta = {"pose": label}`, by which the page chooses.
    """
    n = len(responses[0].joints)
    titles = [f"G<sub>{i + 1}{j + 1}</sub>" for i in range(n) for j in range(n)]
    figure = panels(n, n, 190 * n + 80, titles)
    for number, (response, label) in enumerate(zip(responses, labels, strict=True)):
        curves = (
            ("measured response |G|", abs(response.response), ELASTIC),
            ("nonlinear distortion, 1σ", response.distortion_std, RIGID),
            ("noise, 1σ", response.noise_std, NOMINAL),
        )
        for i in range(n):
            for j in range(n):
                for name, values, colour in curves:
                    figure.add_trace(
                        go.Scatter(
                            x=single(response.frequencies_hz),
                            y=positive(values[:, i, j]),
                            name=name,
                            legendgroup=name,
                            showlegend=i == j == 0,
                            visible=number == 0,
                            meta={"pose": label},
                            mode="lines",
                            line={"color": colour, "width": 1.6},
                            hovertemplate="%{x:.2f} Hz<br>%{y:.3g} rad/s² per N m",
                        ),
                        row=i + 1,
                        col=j + 1,
                    )
    frequency_axes(figure, n, n)
    return figure


def frequency_axes(figure: go.Figure, rows: int, columns: int) -> None:
    """Logarithmic axes for magnitudes against frequency; labels on the outer panels only, one range for all."""
    figure.update_xaxes(type="log", tickvals=FREQUENCY_TICKS, showticklabels=False)
    figure.update_yaxes({"type": "log", "showticklabels": False, "matches": "y"} | decades(-9, 6))
    figure.update_yaxes(matches=None, row=1, col=1)
    for column in range(columns):
        figure.update_xaxes(showticklabels=True, title_text="Hz", row=rows, col=column + 1)
    for row in range(rows):
        figure.update_yaxes(showticklabels=True, row=row + 1, col=1)
    figure.update_yaxes(title_text="rad/s² per N m", row=(rows + 1) // 2, col=1)
