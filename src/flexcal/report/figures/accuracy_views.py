"""Predicted tool error in three views."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.calibration import AccuracyMap
from flexcal.report.figures.accuracy_space import COLOURS
from flexcal.report.figures.canvas import panels, single
from flexcal.units import MILLIMETRE

_CELLS = 30
"""Along the longer side of a view, with points enough for them."""
_POINTS = 8
"""In a cell, on average, at least."""
_VIEWS = {"from above": (0, 1), "from the side": (0, 2), "from the front": (1, 2)}


def accuracy_views(found: AccuracyMap) -> go.Figure:
    """For each cell of three views of the volume (base frame) the 95 % error in mm, averaged over the poses behind it."""
    cells = int(np.clip(np.sqrt(len(found.q) / _POINTS), 3, _CELLS))
    titles = [f"{'xyz'[up]} / m, {view}" for view, (_, up) in _VIEWS.items()]
    figure = panels(1, 3, 340, titles, legend=False, column_gap=0.1)
    error = found.p95 / MILLIMETRE
    largest = 0.0
    for column, (across, up) in enumerate(_VIEWS.values(), start=1):
        x, y = found.position[:, across], found.position[:, up]
        count, x_edges, y_edges = np.histogram2d(x, y, bins=cells)
        total = np.histogram2d(x, y, bins=[x_edges, y_edges], weights=error)[0]
        mean = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
        largest = max(largest, float(np.nanmax(mean)))
        figure.add_trace(
            go.Heatmap(
                x=single((x_edges[1:] + x_edges[:-1]) / 2),
                y=single((y_edges[1:] + y_edges[:-1]) / 2),
                z=single(mean.T),
                coloraxis="coloraxis",
                hoverongaps=False,
                hovertemplate="%{x:.2f}, %{y:.2f} m: 95 % within %{z:.3f} mm<extra></extra>",
            ),
            row=1,
            col=column,
        )
        figure.update_xaxes(title_text=f"{'xyz'[across]} / m", row=1, col=column)
    bar = {"title": {"text": "mm", "side": "top"}, "thickness": 12, "len": 0.8}
    figure.update_layout(
        coloraxis={"colorscale": COLOURS, "colorbar": bar, "cmin": 0, "cmax": largest},
        margin={"l": 56, "r": 60, "t": 30, "b": 46},
    )
    return figure
