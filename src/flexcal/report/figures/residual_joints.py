"""Residuals against every joint position; waves and slopes indicate missing terms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.data import PoseSet
from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, INK
from flexcal.units import DEGREE, MILLIMETRE

_BINS = 12
_COLUMNS = 3


def residual_joints(joints: Mapping[str, str], poses: PoseSet, residuals: np.ndarray) -> go.Figure:
    """Distance (mm) of residuals (N, 3) m against each joint (degrees, or mm where prismatic), and its mean in twelve bins.

    `joints` are kinds (revolute, prismatic) by name.
    """
    rows = -(-len(joints) // _COLUMNS)
    figure = panels(rows, _COLUMNS, 230 * rows + 70, list(joints), row_gap=0.3 / rows)
    distance = np.linalg.norm(residuals, axis=1) / MILLIMETRE
    for i, kind in enumerate(joints.values()):
        row, column = i // _COLUMNS + 1, i % _COLUMNS + 1
        revolute = kind == "revolute"
        q = poses.q[:, i] / (DEGREE if revolute else MILLIMETRE)
        figure.add_trace(
            go.Scatter(
                x=single(q), y=single(distance), mode="markers", name="error", legendgroup="a", showlegend=i == 0,
                marker={"color": ELASTIC, "size": 3.5, "opacity": 0.45},
                hovertemplate="%{x:.1f}: %{y:.3f} mm",
            ), row=row, col=column,
        )  # fmt: skip
        centres, means = _binned(q, distance)
        figure.add_trace(
            go.Scatter(
                x=single(centres), y=single(means), mode="lines+markers", name="mean", legendgroup="b", showlegend=i == 0,
                line={"color": INK, "width": 1.6}, marker={"size": 4}, hoverinfo="skip",
            ), row=row, col=column,
        )  # fmt: skip
        figure.update_xaxes(title_text="degrees" if revolute else "mm", nticks=5, row=row, col=column)
        figure.update_yaxes(matches="y" if i else None, showticklabels=column == 1, row=row, col=column)
    figure.update_yaxes(rangemode="tozero", nticks=5)
    figure.update_yaxes(title_text="error / mm", row=(rows + 1) // 2, col=1)
    return figure


def _binned(q: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    edges = np.linspace(q.min(), q.max() + 1e-9, _BINS + 1)
    number = np.clip(np.digitize(q, edges) - 1, 0, _BINS - 1)
    filled = [k for k in range(_BINS) if (number == k).any()]
    centres = 0.5 * (edges[:-1] + edges[1:])[filled]
    return centres, np.array([values[number == k].mean() for k in filled])
