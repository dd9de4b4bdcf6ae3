"""Predicted tool error in three dimensions."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.calibration import AccuracyMap
from flexcal.report.figures.arm_poses import space_axes
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, GRID, RIGID
from flexcal.units import MILLIMETRE

COLOURS = [[0, GRID], [0.5, ELASTIC], [1, RIGID]]
SHOWN = 4000
"""Points drawn; of more, every so manieth."""


def accuracy_space(found: AccuracyMap) -> go.Figure:
    """Points in the robot's base frame, coloured by the distance (mm) that 95 % of errors stay below."""
    rows = slice(None, None, max(1, -(-len(found.q) // SHOWN)))
    at, error = found.position[rows], found.p95[rows] / MILLIMETRE
    figure = canvas(560, legend=False)
    figure.add_trace(
        go.Scatter3d(
            x=single(at[:, 0]),
            y=single(at[:, 1]),
            z=single(at[:, 2]),
            mode="markers",
            marker={
                "size": 3,
                "color": single(error),
                "colorscale": COLOURS,
                "cmin": 0.0,
                "cmax": float(np.quantile(error, 0.995)),
                "colorbar": colour_bar(),
            },
            text=single(error),
            hovertemplate="95 % within %{text:.3f} mm<extra></extra>",
        )
    )
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 10, "b": 0})
    return figure


def colour_bar() -> dict[str, object]:
    """The bar that says what the colours mean."""
    return {
        "title": {"text": "95 % / mm", "side": "top"},
        "thickness": 12,
        "len": 0.7,
        "x": 1,
        "xanchor": "right",
    }
