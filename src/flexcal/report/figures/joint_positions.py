"""Joint positions of planned poses between their limits."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.model import RobotModel
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import AXIS, ELASTIC
from flexcal.units import DEGREE, MILLIMETRE


def joint_positions(model: RobotModel, q: np.ndarray) -> go.Figure:
    """One row a joint of the positions `q` (N, n), from its lower limit at the left to the upper at the right."""
    figure = canvas(90 + 44 * model.n, legend=False)
    for i, joint in enumerate(model.joints):
        unit, name = (MILLIMETRE, "mm") if joint.kind == "prismatic" else (DEGREE, "°")
        ends = [joint.lower, joint.upper]
        if not np.isfinite(ends).all():
            ends = [min(-np.pi, float(q[:, i].min())), max(np.pi, float(q[:, i].max()))]
        share = (q[:, i] - ends[0]) / (ends[1] - ends[0])
        figure.add_trace(
            go.Scatter(
                x=[0, 1], y=[joint.name] * 2, mode="lines+text", cliponaxis=False, line={"color": AXIS, "width": 2},
                text=[f"{end / unit:.0f} {name}".replace("-", "−") for end in ends], textposition=["middle left", "middle right"],
                hoverinfo="skip",
            )
        )  # fmt: skip
        figure.add_trace(
            go.Scatter(
                x=single(share), y=[joint.name] * len(q), mode="markers",
                marker={"color": ELASTIC, "size": 14, "symbol": "line-ns-open", "line": {"width": 1.5, "color": ELASTIC}},
                text=[f"pose {k}: {value / unit:.1f} {name}" for k, value in enumerate(q[:, i], 1)],
                hovertemplate="%{text}<extra></extra>",
            )
        )  # fmt: skip
    figure.update_xaxes(
        range=[-0.1, 1.1], showticklabels=False, ticks="", showgrid=False, title_text="between the limits"
    )
    figure.update_yaxes(autorange="reversed", showgrid=False)
    return figure
