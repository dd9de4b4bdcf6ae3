"""Fig. 11: the error at every calibration pose, before and after."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.data import PoseSet
from flexcal.report.figures.canvas import canvas, positive, single
from flexcal.report.palette import ELASTIC, NOMINAL
from flexcal.units import MILLIMETRE


def calibration_errors(poses: PoseSet, before: np.ndarray, after: np.ndarray) -> go.Figure:
    """Distances in millimetres (log scale) of the error vectors `before` and `after` (N, 3) m, against the number of the pose."""
    figure = canvas(380)
    for name, errors, colour, symbol in (
        ("before, the robot's own", before, NOMINAL, "diamond"),
        ("calibrated", after, ELASTIC, "circle"),
    ):
        figure.add_trace(
            go.Scatter(
                x=single(poses.pose),
                y=positive(np.linalg.norm(errors, axis=1) / MILLIMETRE),
                mode="markers",
                marker={"color": colour, "size": 7 if len(poses) <= 200 else 4, "symbol": symbol},
                name=name,
                hovertemplate="pose %{x}: %{y:.3f} mm",
            )
        )
    millimetre_axis(figure)
    figure.update_xaxes(title_text="calibration pose")
    return figure


def millimetre_axis(figure: go.Figure, axis: str = "y", title: str = "error / mm") -> None:
    """A logarithmic axis in millimetres with plain numbers at 1, 2 and 5."""
    ticks = [m * 10.0**e for e in range(-4, 3) for m in (1, 2, 5)]
    update = figure.update_yaxes if axis == "y" else figure.update_xaxes
    update(type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks], title_text=title)
