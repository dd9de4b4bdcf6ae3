"""Magnitude, phase and coherence of a measured response with its fits."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import decades, panels, positive, single
from flexcal.report.palette import ELASTIC, NOMINAL, RIGID


def bode(
    frequencies_hz: np.ndarray,
    response: np.ndarray,
    std: np.ndarray,
    coherence: np.ndarray,
    fits: Mapping[str, np.ndarray],
    unit: str,
) -> go.Figure:
    """Of one element: response (L,), its standard deviation (L,), the coherence (L,) and fitted responses (L,) by name."""
    figure = panels(3, 1, 640, ("magnitude", "phase", "coherence"), row_gap=0.08)
    x = single(frequencies_hz)
    curves = [("measured", response, ELASTIC, "solid")]
    curves += [
        (name, values, colour, "dash")
        for (name, values), colour in zip(fits.items(), (RIGID, NOMINAL), strict=False)
    ]
    for name, values, colour, dash in curves:
        line = {"color": colour, "width": 1.6, "dash": dash}
        figure.add_trace(
            go.Scatter(
                x=x,
                y=positive(np.abs(values)),
                name=name,
                legendgroup=name,
                mode="lines",
                line=line,
                hovertemplate=f"%{{x:.4g}} Hz<br>%{{y:.3g}} {unit}",
            ),
            row=1,
            col=1,
        )
        phase = np.degrees(np.angle(values * np.exp(-0.5j * np.pi))) + 90.0
        figure.add_trace(
            go.Scatter(
                x=x,
                y=single(phase),
                name=name,
                legendgroup=name,
                showlegend=False,
                mode="lines",
                line=line,
                hovertemplate="%{x:.4g} Hz<br>%{y:.0f}°",
            ),
            row=2,
            col=1,
        )
    figure.add_trace(
        go.Scatter(
            x=x,
            y=positive(std),
            name="1σ of the measured",
            mode="lines",
            line={"color": NOMINAL, "width": 1.0},
            hovertemplate=f"%{{x:.4g}} Hz<br>%{{y:.3g}} {unit}",
        ),
        row=1,
        col=1,
    )
    figure.add_trace(
        go.Scatter(
            x=x,
            y=single(coherence),
            showlegend=False,
            mode="lines",
            line={"color": ELASTIC, "width": 1.6},
            hovertemplate="%{x:.4g} Hz<br>%{y:.4f}",
        ),
        row=3,
        col=1,
    )
    ticks = [v * 10.0**p for p in range(-3, 4) for v in (1, 2, 5)]
    figure.update_xaxes(type="log", tickvals=ticks, ticktext=[f"{v:g}" for v in ticks])
    figure.update_xaxes(title_text="Hz", row=3, col=1)
    figure.update_yaxes({"type": "log", "title_text": unit} | decades(-9, 9), row=1, col=1)
    figure.update_yaxes(title_text="°", tickvals=[-90, 0, 90, 180, 270], row=2, col=1)
    figure.update_yaxes(range=[0, 1.05], row=3, col=1)
    return figure
