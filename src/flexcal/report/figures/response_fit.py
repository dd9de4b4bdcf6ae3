"""Figs. 7-9: measured frequency responses against the fitted model, pose by pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import decades, panels, positive, single
from flexcal.report.figures.response_levels import FREQUENCY_TICKS, frequency_axes
from flexcal.report.fitted_response import FittedResponse
from flexcal.report.palette import ELASTIC, INK


def response_fit(responses: Sequence[FittedResponse], labels: Sequence[str]) -> go.Figure:
    """Magnitude of every element and phase of the diagonal ones: dots measured, lines the model, one pose shown at a time.

    Traces carry `meta = {"pose": label}`, by which the page chooses.
    """
    n = len(responses[0].joints)
    titles = [f"|G<sub>{i + 1}{j + 1}</sub>|" for i in range(n) for j in range(n)]
    titles += [f"phase of G<sub>{i + 1}{i + 1}</sub>" for i in range(n)]
    figure = panels(n + 1, n, 175 * (n + 1) + 80, titles)
    for number, (response, label) in enumerate(zip(responses, labels, strict=True)):
        pairs = ((response.response, "measured"), (response.predicted, "model"))
        for i in range(n):
            for j in range(n):
                for values, kind in pairs:
                    trace = _trace(response.frequencies_hz, positive(abs(values[:, i, j])), kind, label)
                    trace.update(showlegend=i == j == 0, visible=number == 0)
                    figure.add_trace(trace, row=i + 1, col=j + 1)
            for values, kind in pairs:
                degrees = np.degrees(np.angle(values[:, i, i]))
                trace = _trace(response.frequencies_hz, single(degrees), kind, label)
                trace.update(showlegend=False, visible=number == 0)
                trace.update(hovertemplate="%{x:.2f} Hz<br>%{y:.0f}°")
                figure.add_trace(trace, row=n + 1, col=i + 1)
    frequency_axes(figure, n + 1, n)
    figure.update_yaxes(
        type="linear",
        matches=f"y{n * n + 1}",
        range=[-200, 200],
        tickvals=[-180, -90, 0, 90, 180],
        ticktext=["−180", "−90", "0", "90", "180"],
        row=n + 1,
    )
    figure.update_yaxes(matches=None, row=n + 1, col=1)
    figure.update_yaxes(title_text="degrees", row=n + 1, col=1)
    figure.update_xaxes(tickvals=FREQUENCY_TICKS)
    return figure


def sensor_fit(responses: Sequence[FittedResponse], labels: Sequence[str]) -> go.Figure:
    """Magnitude of what every sensor on the arm (row) reads per torque on each motor (column): dots measured, lines the model, one pose
    shown at a time as in `response_fit`."""
    units = {name: unit for r in responses for name, unit in zip(r.sensors, r.sensor_units, strict=True)}
    names, joints = list(units), responses[0].joints
    figure = panels(
        len(names),
        len(joints),
        190 * len(names) + 90,
        [f"{name}, {joint}" for name in names for joint in joints],
    )
    for number, (response, label) in enumerate(zip(responses, labels, strict=True)):
        pairs = ((response.sensor_response, "measured"), (response.sensor_predicted, "model"))
        for at, name in enumerate(response.sensors):
            row = names.index(name) + 1
            for column in range(len(joints)):
                for values, kind in pairs:
                    trace = _trace(response.frequencies_hz, positive(abs(values[:, at, column])), kind, label)
                    trace.update(showlegend=row == column + 1 == 1, visible=number == 0)
                    trace.update(hovertemplate=f"%{{x:.2f}} Hz<br>%{{y:.3g}} {units[name]} per N m")
                    figure.add_trace(trace, row=row, col=column + 1)
    figure.update_xaxes(type="log", tickvals=FREQUENCY_TICKS, showticklabels=False)
    figure.update_yaxes({"type": "log", "showticklabels": False} | decades(-9, 6))
    for column in range(len(joints)):
        figure.update_xaxes(showticklabels=True, title_text="Hz", row=len(names), col=column + 1)
    for row, name in enumerate(names, start=1):
        for column in range(len(joints)):
            first = (row - 1) * len(joints) + 1
            figure.update_yaxes(matches=f"y{first}" if first > 1 else "y", row=row, col=column + 1)
        figure.update_yaxes(
            matches=None, showticklabels=True, title_text=f"{units[name]} per N m", row=row, col=1
        )
    return figure


def _trace(frequencies: np.ndarray, values: np.ndarray, kind: str, label: str) -> go.Scatter:
    look = (
        {"mode": "markers", "marker": {"color": INK, "size": 3.5, "opacity": 0.55}}
        if kind == "measured"
        else {"mode": "lines", "line": {"color": ELASTIC, "width": 1.8}}
    )
    return go.Scatter(
        x=single(frequencies),
        y=values,
        name="measured" if kind == "measured" else "fitted model",
        legendgroup=kind,
        meta={"pose": label},
        hovertemplate="%{x:.2f} Hz<br>%{y:.3g} rad/s² per N m",
        **look,
    )
