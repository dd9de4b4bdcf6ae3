"""The poses of a plan in three dimensions, with working volume and instrument."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.arm_poses import polyline, space_axes
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, INK, NOMINAL, QUIET, RIGID

_EDGES = np.array(
    [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 6], [5, 7], [6, 7]]
)


def plan_space(
    corners: np.ndarray,
    links: go.Mesh3d,
    working: np.ndarray | None,
    box: np.ndarray | None,
    station: np.ndarray | None,
) -> go.Figure:
    """Skeletons `corners` (N, K, 3), the `links` in one pose, the target's path, `working` points (W, 3), their `box` (2, 3), the
    instrument (3,); all in m."""
    figure = canvas(620)
    tips = corners[:, -1]
    figure.add_trace(links)
    figure.add_trace(polyline(corners, "arm at other poses", NOMINAL, 2.5, opacity=0.45))
    figure.add_trace(polyline(tips[None], "order", ELASTIC, 3.0, opacity=0.6))
    labels = [f"pose {k}" for k in range(1, len(tips) + 1)]
    figure.add_trace(_points(tips, "target", ELASTIC, 4, labels))
    if working is not None:
        figure.add_trace(_points(working, "where it will work", QUIET, 1.5, [""] * len(working)))
    if box is not None:
        ends = box[(np.arange(8)[:, None] >> np.arange(3)) & 1, np.arange(3)]
        figure.add_trace(polyline(ends[_EDGES], "working volume", INK, 4.0))
    if station is not None:
        figure.add_trace(_points(station[None], "instrument", RIGID, 7, ["instrument"]))
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure


def _points(places: np.ndarray, name: str, colour: str, size: float, labels: list[str]) -> go.Scatter3d:
    return go.Scatter3d(
        x=single(places[:, 0]), y=single(places[:, 1]), z=single(places[:, 2]), mode="markers", name=name,
        marker={"size": size, "color": colour}, text=labels, hovertemplate="%{text}<extra></extra>",
        hoverinfo=None if labels[0] else "skip",
    )  # fmt: skip
