"""Errors outside the fit against the number of places and poses that a calibration has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexcal.report.layout import ELASTIC, NOMINAL, QUIET, Figure, as_float32, canvas, trace


def learning_curves(points: Sequence[Mapping[str, Any]]) -> Figure:
    """Mean error (mm) at places left out against the number of places in the fit, a line for each number of poses in a socket."""
    figure = canvas(360)
    numbers = list(dict.fromkeys(point["poses_per_socket"] for point in points))
    for poses, colour in zip(numbers, (QUIET, NOMINAL, ELASTIC), strict=False):
        own = [point for point in points if point["poses_per_socket"] == poses]
        figure.add_trace(
            trace(
                "scatter",
                x=[point["places"] for point in own],
                y=as_float32(np.array([point["mean_mm"] for point in own])),
                mode="lines+markers",
                line={"color": colour, "width": 2},
                name=f"{poses:.0f} poses in a socket",
                hovertemplate="%{x} places: %{y:.3f} mm",
            )
        )
    figure.update_xaxes(title_text="places of the fixture in the fit", dtick=1)
    figure.update_yaxes(title_text="mean error at a place left out / mm", rangemode="tozero")
    return figure
