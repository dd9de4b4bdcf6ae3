"""The arm in the poses of a plan, in three dimensions."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from flexcal.design import joint_origins
from flexcal.model import RobotModel
from flexcal.report.figures.arm_poses import links_at, space_axes
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC


def planned_arm(model: RobotModel, q: np.ndarray) -> go.Figure:
    """The links in the first pose, and lines from the base through every joint to the measured point at each of `q` (P, n) rad."""
    figure, arms = canvas(520), joint_origins(model, q)
    figure.add_trace(links_at(model, q[:1])[0])
    for number, corners in enumerate(arms, start=1):
        figure.add_trace(
            go.Scatter3d(
                x=single(corners[:, 0]),
                y=single(corners[:, 1]),
                z=single(corners[:, 2]),
                mode="lines+markers",
                name=f"pose {number}",
                line={"width": 6, "color": ELASTIC},
                marker={"size": 3, "color": ELASTIC},
                opacity=0.35 + 0.65 * number / len(q),
            )
        )
    figure.update_layout(scene=_cube(arms), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure


def _cube(corners: np.ndarray) -> dict[str, Any]:
    """Axes of equal length about all `corners` (..., 3), m: arms that stand in one plane would else be drawn as large as it is thin."""
    scene: dict[str, Any] = {**space_axes(), "aspectmode": "cube"}
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    half = 0.55 * (high - low).max()
    for axis, middle in zip("xyz", (low + high) / 2, strict=True):
        scene[f"{axis}axis"] |= {"range": [middle - half, middle + half]}
    return scene
