"""Displacement of the tool between two calibrations."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.comparison import GeometryChange
from flexcal.report.figures.accuracy_map import SHOWN, coloured_points
from flexcal.report.figures.robot_arm import space_axes
from flexcal.report.layout import RIGID, Figure, as_float32, canvas, trace
from flexcal.units import MILLIMETRE

_ARROW = 0.15
"""Length of the longest arrow, relative to the extent of the points."""


def tool_displacement(change: GeometryChange) -> Figure:
    """Points in the base frame, coloured by how far they moved (mm), with exaggerated arrows that show where to."""
    rows = slice(None, None, max(1, -(-len(change.q) // SHOWN)))
    at, moved, size, std = (
        values[rows] for values in (change.points, change.displacement, change.distance, change.std)
    )
    extent = float(np.ptp(at, axis=0).max()) or 1.0
    tips = at + moved * _ARROW * extent / max(float(size.max()), 1e-12)
    lines = np.full((len(at), 3, 3), np.nan)
    lines[:, 0], lines[:, 1] = at, tips
    ends = lines.reshape(-1, 3)
    figure = canvas(560, legend=False)
    figure.add_trace(
        trace(
            "scatter3d",
            x=as_float32(ends[:, 0]),
            y=as_float32(ends[:, 1]),
            z=as_float32(ends[:, 2]),
            mode="lines",
            line={"color": RIGID, "width": 2},
            hoverinfo="skip",
        )
    )
    told = [f"{m:.3f} ± {s:.3f}" for m, s in zip(size / MILLIMETRE, std / MILLIMETRE, strict=True)]
    figure.add_trace(coloured_points(at, size / MILLIMETRE, "moved / mm", told, "moved by %{text} mm"))
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 10, "b": 0})
    return figure
