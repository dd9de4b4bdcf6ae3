"""The arm in the poses of a plan, in three dimensions."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.design import joint_origins
from flexcal.model import RobotModel
from flexcal.report.figures.arm_poses import space_axes
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC


def planned_arm(model: RobotModel, q: np.ndarray) -> go.Figure:
    """Skeletons from the base through every joint to the measured point, one a pose of `q` (P, n) rad."""
    figure = canvas(520)
    for number, corners in enumerate(joint_origins(model, q), start=1):
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
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure
