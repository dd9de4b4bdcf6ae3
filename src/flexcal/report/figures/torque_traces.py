"""Measured and predicted torques over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.dynamics import TorquePrediction
from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, NOMINAL, RIGID


def torque_traces(units: Mapping[str, str], logs: Mapping[str, TorquePrediction]) -> go.Figure:
    """Measured and predicted torque of every joint against time (s), one log shown at a time; `units` are N m, or N, by joint.

    What the fit never saw is predicted in a colour of its own. Traces carry `meta = {"log": label}`, by which the page chooses.
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
            for joint, unit in enumerate(units.values()):
                figure.add_trace(
                    go.Scatter(
                        x=single(log.time[part]),
                        y=single(torque[part, joint]),
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


def labelled(units: Mapping[str, str]) -> tuple[str, ...]:
    """The joints; where units differ, with those of the ones that slide."""
    mixed = len(set(units.values())) > 1
    return tuple(f"{joint} ({unit})" if mixed and unit == "N" else joint for joint, unit in units.items())


def axis_title(units: Mapping[str, str]) -> str:
    """Quantity and unit of an axis."""
    names = {"N m": "torque", "N": "force"}
    return ", ".join(f"{names[unit]} / {unit}" for unit in dict.fromkeys(units.values()))
