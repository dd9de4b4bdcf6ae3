"""Measured frequency responses with their noise and distortion, and with fitted models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.report.layout import (
    ELASTIC,
    INK,
    NOMINAL,
    RIGID,
    Figure,
    Trace,
    as_float32,
    log_ticks,
    panels,
    positive,
    trace,
)
from flexcal.report.results import FittedResponse, MeasuredResponse

FREQUENCY_TICKS = (1, 3, 10, 30, 100, 300)


def response_levels(responses: Sequence[MeasuredResponse], labels: Sequence[str]) -> Figure:
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
                        trace(
                            "scatter",
                            x=as_float32(response.frequencies_hz),
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


def frequency_axes(figure: Figure, rows: int, columns: int) -> None:
    """Logarithmic axes for magnitudes against frequency; labels on the outer panels only, one range for all."""
    figure.update_xaxes(type="log", tickvals=FREQUENCY_TICKS, showticklabels=False)
    figure.update_yaxes({"type": "log", "showticklabels": False, "matches": "y"} | log_ticks(-9, 6))
    figure.update_yaxes(matches=None, row=1, col=1)
    for column in range(columns):
        figure.update_xaxes(showticklabels=True, title_text="Hz", row=rows, col=column + 1)
    for row in range(rows):
        figure.update_yaxes(showticklabels=True, row=row + 1, col=1)
    figure.update_yaxes(title_text="rad/s² per N m", row=(rows + 1) // 2, col=1)


def response_fit(responses: Sequence[FittedResponse], labels: Sequence[str]) -> Figure:
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
                trace = _trace(response.frequencies_hz, as_float32(degrees), kind, label)
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


def sensor_fit(responses: Sequence[FittedResponse], labels: Sequence[str]) -> Figure:
    """Magnitude of the readings of every sensor on the arm (row) per torque on each motor (column): dots measured, lines the model, one
    pose shown at a time as in `response_fit`.
    """
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
    figure.update_yaxes({"type": "log", "showticklabels": False} | log_ticks(-9, 6))
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


def _trace(frequencies: np.ndarray, values: np.ndarray, kind: str, label: str) -> Trace:
    look = (
        {"mode": "markers", "marker": {"color": INK, "size": 3.5, "opacity": 0.55}}
        if kind == "measured"
        else {"mode": "lines", "line": {"color": ELASTIC, "width": 1.8}}
    )
    return trace(
        "scatter",
        x=as_float32(frequencies),
        y=values,
        name="measured" if kind == "measured" else "fitted model",
        legendgroup=kind,
        meta={"pose": label},
        hovertemplate="%{x:.2f} Hz<br>%{y:.3g} rad/s² per N m",
        **look,
    )


def bode(
    frequencies_hz: np.ndarray,
    response: np.ndarray,
    std: np.ndarray,
    coherence: np.ndarray,
    fits: Mapping[str, np.ndarray],
    unit: str,
) -> Figure:
    """Bode plot of one element: response (L,), its standard deviation (L,), the coherence (L,) and fitted responses (L,) by name."""
    figure = panels(3, 1, 640, ("magnitude", "phase", "coherence"), row_gap=0.08)
    x = as_float32(frequencies_hz)
    curves = [("measured", response, ELASTIC, "solid")]
    curves += [
        (name, values, colour, "dash")
        for (name, values), colour in zip(fits.items(), (RIGID, NOMINAL), strict=False)
    ]
    for name, values, colour, dash in curves:
        line = {"color": colour, "width": 1.6, "dash": dash}
        figure.add_trace(
            trace(
                "scatter",
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
            trace(
                "scatter",
                x=x,
                y=as_float32(phase),
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
        trace(
            "scatter",
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
        trace(
            "scatter",
            x=x,
            y=as_float32(coherence),
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
    figure.update_yaxes({"type": "log"} | log_ticks(-9, 9), title_text=unit, row=1, col=1)
    figure.update_yaxes(title_text="°", tickvals=[-90, 0, 90, 180, 270], row=2, col=1)
    figure.update_yaxes(range=[0, 1.05], row=3, col=1)
    return figure
