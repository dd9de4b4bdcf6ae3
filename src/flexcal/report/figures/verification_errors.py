"""Fig. 13: errors at poses outside the fit, with and without elasticity in the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from flexcal.calibration import ErrorStatistics, Verification
from flexcal.data import PoseSet
from flexcal.report.figures.calibration_errors import millimetre_axis
from flexcal.report.figures.canvas import canvas, positive, single
from flexcal.report.palette import ELASTIC, INK
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class ErrorSeries:
    """One model's errors (N, 3) m on common poses, with the name and colour under which they are drawn."""

    name: str
    colour: str
    errors: np.ndarray

    @property
    def millimetres(self) -> np.ndarray:
        """Distances (N,)."""
        return np.linalg.norm(self.errors, axis=1) / MILLIMETRE


def verification_errors(
    poses: PoseSet, series: Sequence[ErrorSeries], calibrated: Verification, paper: ErrorStatistics | None
) -> go.Figure:
    """Distances in millimetres (log scale) against the number of the pose; poses with an uncertain flank are ringed."""
    figure = canvas(420)
    for item in series:
        figure.add_trace(
            go.Scatter(
                x=single(poses.pose),
                y=positive(item.millimetres),
                mode="markers",
                marker={"color": item.colour, "size": 6 if len(poses) <= 200 else 4},
                name=item.name,
                hovertemplate="pose %{x}: %{y:.3f} mm",
            )
        )
    unclear = calibrated.ambiguous
    if unclear.any():
        distance = np.linalg.norm(calibrated.errors, axis=1) / MILLIMETRE
        figure.add_trace(
            go.Scatter(
                x=single(poses.pose[unclear]),
                y=positive(distance[unclear]),
                mode="markers",
                marker={
                    "color": ELASTIC,
                    "size": 14,
                    "symbol": "circle-open",
                    "line": {"width": 2, "color": INK},
                },
                name="backlash flank uncertain",
                hovertemplate="pose %{x}: %{y:.3f} mm, backlash flank uncertain",
            )
        )
    if paper is not None:
        ends = single([poses.pose.min(), poses.pose.max()])
        for value, share, dash in ((paper.p90, "90 %", "dot"), (paper.max, "worst", "dash")):
            if np.isfinite(value):
                name = f"paper, {share}"
                line = {"color": INK, "width": 1.2, "dash": dash}
                both = single(np.full(2, value / MILLIMETRE))
                figure.add_trace(
                    go.Scatter(x=ends, y=both, mode="lines", line=line, name=name, hoverinfo="name+y")
                )
    millimetre_axis(figure)
    figure.update_xaxes(title_text="verification pose")
    return figure
