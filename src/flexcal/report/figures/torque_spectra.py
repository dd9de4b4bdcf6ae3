"""Spectra of measured and residual torques."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.dynamics import TorquePrediction
from flexcal.report.figures.canvas import decades, panels, positive, single
from flexcal.report.figures.torque_traces import labelled
from flexcal.report.palette import NOMINAL, RIGID

_COLUMNS = 3


def torque_spectra(units: Mapping[str, str], logs: Mapping[str, TorquePrediction]) -> go.Figure:
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
                    go.Scatter(
                        x=single(log.frequencies_hz),
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
    figure.update_yaxes({"type": "log"} | decades(-9, 6))
    title = ", ".join(f"{unit}/√Hz" for unit in dict.fromkeys(units.values()))
    figure.update_yaxes(title_text=title, row=(rows + 1) // 2, col=1)
    return figure
