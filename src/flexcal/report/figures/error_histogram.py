"""Histogram of the errors, before and after."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.calibration_errors import millimetre_axis
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.measured_points import CALIBRATED, NOMINAL
from flexcal.report.palette import ELASTIC, QUIET
from flexcal.report.palette import NOMINAL as GREY
from flexcal.units import MILLIMETRE

_PER_DECADE = 12
_LOOK = {NOMINAL: ("as delivered", GREY), CALIBRATED: ("calibrated", ELASTIC)}


def error_histogram(errors: Mapping[str, np.ndarray]) -> go.Figure:
    """Share of points (percent) by distance (mm), in bins of equal ratio; `errors` (N, 3) m by model, as delivered and calibrated."""
    figure = canvas(360)
    distances = {
        model: np.maximum(np.linalg.norm(errors[model], axis=1) / MILLIMETRE, 1e-6)
        for model in _LOOK
        if model in errors
    }
    everything = np.concatenate(list(distances.values()))
    low = np.floor(_PER_DECADE * np.log10(np.quantile(everything, 0.005)))
    high = np.ceil(_PER_DECADE * np.log10(everything.max()) + 1e-9)
    edges = 10.0 ** (np.arange(low, high + 1) / _PER_DECADE)
    for model, distance in distances.items():
        label, colour = _LOOK[model]
        count, _ = np.histogram(np.clip(distance, edges[0], edges[-1]), edges)
        share = 100 * count / len(distance)
        outline = np.repeat(edges, 2)[1:-1]
        figure.add_trace(
            go.Scatter(
                x=single(outline), y=single(np.repeat(share, 2)), mode="lines", fill="tozeroy", name=label,
                line={"color": colour, "width": 1.5}, opacity=0.7,
                hovertemplate="%{x:.3f} mm: %{y:.1f} % of points",
            )
        )  # fmt: skip
        middle = float(np.median(distance))
        figure.add_vline(x=middle, line={"color": colour, "width": 1.5, "dash": "dot"})
        figure.add_annotation(
            x=np.log10(middle), y=1, yref="paper", text=f"median {middle:.3f}", showarrow=False, xanchor="left", xshift=4,
            font={"size": 11, "color": QUIET},
        )  # fmt: skip
    millimetre_axis(figure, "x")
    figure.update_xaxes(range=[np.log10(edges[0]), np.log10(edges[-1])])
    figure.update_yaxes(title_text="share of points", ticksuffix=" %", rangemode="tozero")
    return figure
