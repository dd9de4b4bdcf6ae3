"""Measured and predicted torques over time and frequency."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.report.layout import (
    ELASTIC,
    NOMINAL,
    RIGID,
    Figure,
    as_float32,
    log_ticks,
    panels,
    positive,
    trace,
)

_APART = 1.5
"""Steps between rows above which there is a gap."""


def torque_traces(units: Mapping[str, str], logs: Mapping[str, TorquePrediction]) -> Figure:
    """Measured and predicted torque of every joint against time (s), one log shown at a time; `units` are N m, or N, by joint.

    What the fit never saw is predicted in a colour of its own; lines end at
    the gaps of a log. Traces carry `meta = {"log": label}`, by which the page chooses.
    """
    n = len(units)
    figure = panels(n, 1, 150 * n + 90, labelled(units), row_gap=0.28 / n)
    for number, (label, log) in enumerate(logs.items()):
        unseen = log.held_out
        curves = (
            ("measured", log.measured, np.ones_like(unseen), NOMINAL, 2.2),
            ("predicted, in the fit", log.predicted, ~unseen, ELASTIC, 1.2),
            ("predicted, outside the fit", log.predicted, unseen, RIGID, 1.2),
        )
        for kind, torque, part, colour, width in curves:
            if not part.any():
                continue
            time, values = _interrupted(log.time[part], torque[part])
            for joint, unit in enumerate(units.values()):
                figure.add_trace(
                    trace(
                        "scatter",
                        x=as_float32(time),
                        y=as_float32(values[:, joint]),
                        name=kind,
                        legendgroup=kind,
                        showlegend=joint == 0,
                        mode="lines",
                        line={"color": colour, "width": width},
                        meta={"log": label},
                        visible=number == 0,
                        hovertemplate=f"%{{x:.2f}} s: %{{y:.3g}} {unit}",
                    ),
                    row=joint + 1,
                    col=1,
                )
    figure.update_xaxes(matches="x", showticklabels=False)
    figure.update_xaxes(showticklabels=True, title_text="time / s", row=n, col=1)
    figure.update_yaxes(nticks=5)
    figure.update_yaxes(title_text=axis_title(units), row=(n + 1) // 2, col=1)
    return figure


def _interrupted(time: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`time` (N,) and `torque` (N, n) with a row of NaN in every gap of a recording, across which no line is drawn."""
    steps = np.diff(time)
    gaps = 1 + np.flatnonzero(steps > _APART * np.median(steps)) if len(steps) else []
    return np.insert(time, gaps, np.nan), np.insert(torque, gaps, np.nan, axis=0)


def labelled(units: Mapping[str, str]) -> tuple[str, ...]:
    """Names of the joints; where units differ, prismatic ones with theirs."""
    mixed = len(set(units.values())) > 1
    return tuple(f"{joint} ({unit})" if mixed and unit == "N" else joint for joint, unit in units.items())


def axis_title(units: Mapping[str, str]) -> str:
    """Quantity and unit of an axis."""
    names = {"N m": "torque", "N": "force"}
    return ", ".join(f"{names[unit]} / {unit}" for unit in dict.fromkeys(units.values()))


_COLUMNS = 3


def torque_spectra(units: Mapping[str, str], logs: Mapping[str, TorquePrediction]) -> Figure:
    """Amplitude density of the measured torque and of the residual of every joint, one log shown at a time.

    `units` are N m, or N, by joint; densities are these per √Hz.

    Traces carry `meta = {"log": label}`, by which the page chooses.
    """
    rows = -(-len(units) // _COLUMNS)
    figure = panels(rows, _COLUMNS, 230 * rows + 70, labelled(units), row_gap=0.3 / rows)
    for number, (label, log) in enumerate(logs.items()):
        curves = (
            ("measured torque", log.measured_density, NOMINAL),
            ("measured minus predicted", log.residual_density, RIGID),
        )
        for kind, density, colour in curves:
            for joint, unit in enumerate(units.values()):
                figure.add_trace(
                    trace(
                        "scatter",
                        x=as_float32(log.frequencies_hz),
                        y=positive(np.sqrt(density[:, joint])),
                        name=kind,
                        legendgroup=kind,
                        showlegend=joint == 0,
                        mode="lines",
                        line={"color": colour, "width": 1.6},
                        meta={"log": label},
                        visible=number == 0,
                        hovertemplate=f"%{{x:.2f}} Hz<br>%{{y:.3g}} {unit}/√Hz",
                    ),
                    row=joint // _COLUMNS + 1,
                    col=joint % _COLUMNS + 1,
                )
    figure.update_xaxes(title_text="Hz", nticks=6)
    figure.update_yaxes({"type": "log"} | log_ticks(-9, 6))
    title = ", ".join(f"{unit}/√Hz" for unit in dict.fromkeys(units.values()))
    figure.update_yaxes(title_text=title, row=(rows + 1) // 2, col=1)
    return figure
