"""Predicted tool error over the working volume, and its sources."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.calibration.accuracy import PredictedAccuracy
from flexcal.report.figures.robot_arm import space_axes
from flexcal.report.layout import ELASTIC, GRID, RIGID, Figure, Trace, as_float32, canvas, panels, trace
from flexcal.units import MILLIMETRE

COLOURS = [[0, GRID], [0.5, ELASTIC], [1, RIGID]]
SHOWN = 4000
"""Largest number of points drawn; of more, a regular subset."""


def accuracy_space(accuracy: PredictedAccuracy) -> Figure:
    """Points in the robot's base frame, coloured by the distance (mm) that 95 % of errors stay below."""
    rows = slice(None, None, max(1, -(-len(accuracy.q) // SHOWN)))
    at, error = accuracy.position[rows], accuracy.p95[rows] / MILLIMETRE
    figure = canvas(560, legend=False)
    figure.add_trace(
        coloured_points(
            at,
            error,
            "95 % / mm",
            error,
            "95 % within %{text:.3f} mm",
            largest=float(np.quantile(error, 0.995)),
        )
    )
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 10, "b": 0})
    return figure


def coloured_points(
    at: np.ndarray,
    values: np.ndarray,
    title: str,
    told: np.ndarray | Sequence[str],
    hover: str,
    *,
    largest: float | None = None,
) -> Trace:
    """Points (N, 3), m, coloured by `values` (N,) up to the `largest`; `title` is that of the colour bar, `hover` shows each as `told`."""
    bar = {"title": {"text": title, "side": "top"}, "thickness": 12, "len": 0.7, "x": 1, "xanchor": "right"}
    marker = {
        "size": 3,
        "color": as_float32(values),
        "colorscale": COLOURS,
        "cmin": 0.0,
        "colorbar": bar,
    } | ({} if largest is None else {"cmax": largest})
    return trace(
        "scatter3d",
        x=as_float32(at[:, 0]),
        y=as_float32(at[:, 1]),
        z=as_float32(at[:, 2]),
        mode="markers",
        marker=marker,
        text=told,
        hovertemplate=f"{hover}<extra></extra>",
    )


_CELLS = 30
"""Largest number of cells along the longer side of a view."""
_POINTS = 8
"""Least average number of points in a cell."""
_VIEWS = {"from above": (0, 1), "from the side": (0, 2), "from the front": (1, 2)}


def accuracy_views(accuracy: PredictedAccuracy) -> Figure:
    """For each cell of three views of the volume (base frame) the 95 % error in mm, averaged over the poses behind it."""
    cells = int(np.clip(np.sqrt(len(accuracy.q) / _POINTS), 3, _CELLS))
    titles = [f"{'xyz'[up]} / m, {view}" for view, (_, up) in _VIEWS.items()]
    figure = panels(1, 3, 340, titles, legend=False, column_gap=0.1)
    error = accuracy.p95 / MILLIMETRE
    largest = 0.0
    for column, (across, up) in enumerate(_VIEWS.values(), start=1):
        x, y = accuracy.position[:, across], accuracy.position[:, up]
        count, x_edges, y_edges = np.histogram2d(x, y, bins=cells)
        total = np.histogram2d(x, y, bins=[x_edges, y_edges], weights=error)[0]
        mean = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
        largest = max(largest, float(np.nanmax(mean)))
        figure.add_trace(
            trace(
                "heatmap",
                x=as_float32((x_edges[1:] + x_edges[:-1]) / 2),
                y=as_float32((y_edges[1:] + y_edges[:-1]) / 2),
                z=as_float32(mean.T),
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


def variance_shares(over_all: Mapping[str, float], worst: Mapping[str, float]) -> Figure:
    """Shares of the variance (0 to 1) that knowing a kind of parameter would take away, over all poses and at the worst place."""
    figure = canvas(90 + 44 * len(over_all))
    for label, shares, colour in (
        ("everywhere, on average", over_all, ELASTIC),
        ("at the worst place", worst, RIGID),
    ):
        figure.add_trace(
            trace(
                "bar",
                x=[100 * share for share in shares.values()],
                y=list(shares),
                orientation="h",
                name=label,
                marker={"color": colour},
                hovertemplate="%{y}: %{x:.1f} %<extra></extra>",
            )
        )
    figure.update_xaxes(title_text="reduction of the variance if known", ticksuffix=" %", range=[0, 100])
    figure.update_yaxes(autorange="reversed")
    return figure
