"""Residuals over the working volume."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.data import PoseSet
from flexcal.report.figures.arm_poses import space_axes
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import AXIS, ELASTIC, GRID, RIGID
from flexcal.units import MILLIMETRE


def residual_workspace(poses: PoseSet, residuals: np.ndarray) -> go.Figure:
    """Measured points in the instrument's frame, coloured by the distance (mm) of residuals (N, 3) m."""
    figure = canvas(560, legend=False)
    distance = np.linalg.norm(residuals, axis=1) / MILLIMETRE
    figure.add_trace(
        go.Scatter3d(
            x=single(poses.position[:, 0]),
            y=single(poses.position[:, 1]),
            z=single(poses.position[:, 2]),
            mode="markers",
            marker={
                "size": 5 if len(poses) <= 300 else 3.5,
                "color": single(distance),
                "cmin": 0,
                "cmax": float(np.quantile(distance, 0.99)) if len(distance) else 1.0,
                "colorscale": [[0, GRID], [0.5, ELASTIC], [1, RIGID]],
                "line": {"width": 0.5, "color": AXIS},
                "colorbar": {"title": {"text": "error / mm", "side": "top"}, "thickness": 12, "len": 0.6, "x": 1, "xanchor": "right"},
            },
            text=[f"pose {k}: {d:.3f} mm" for k, d in zip(poses.pose, distance, strict=True)],
            hovertemplate="%{text}<extra></extra>",
        )
    )  # fmt: skip
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 10, "b": 0})
    return figure
