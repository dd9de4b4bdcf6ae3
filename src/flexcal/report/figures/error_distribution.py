"""Cumulative distribution of the errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.calibration_errors import millimetre_axis
from flexcal.report.figures.canvas import canvas, positive, single
from flexcal.report.figures.verification_errors import ErrorSeries
from flexcal.report.palette import GRID, INK, QUIET


def error_distribution(
    series: Sequence[ErrorSeries], published: Mapping[str, tuple[float, float]]
) -> go.Figure:
    """Share of poses (percent) against error (mm, log scale); `published` holds points (error in m, share) by name."""
    figure = canvas(400)
    figure.add_hline(y=90, line={"color": GRID, "width": 2})
    for item in series:
        distance = np.sort(item.millimetres)
        share = 100 * np.arange(1, len(distance) + 1) / len(distance)
        figure.add_trace(
            go.Scatter(
                x=positive(distance),
                y=single(share),
                mode="lines",
                line={"color": item.colour, "width": 2.5, "shape": "hv"},
                name=item.name,
                hovertemplate="%{y:.0f} % of poses within %{x:.3f} mm",
            )
        )
    for name, (error, share) in published.items():
        figure.add_trace(
            go.Scatter(
                x=[error * 1e3],
                y=[100 * share],
                mode="markers",
                marker={
                    "color": INK,
                    "size": 10,
                    "symbol": "star-diamond-open" if "rigid" in name else "diamond-open",
                },
                name=name,
                hovertemplate="%{fullData.name}: %{x:.2f} mm<extra></extra>",
            )
        )
    millimetre_axis(figure, "x")
    everything = np.concatenate([item.millimetres for item in series])
    everything = everything[everything > 0]
    if len(everything):
        low, high = float(np.quantile(everything, 0.002)), float(everything.max())
        figure.update_xaxes(range=[np.log10(low / 1.2), np.log10(high * 1.2)])
    figure.update_yaxes(title_text="share of poses", ticksuffix=" %", range=[0, 104])
    figure.add_annotation(
        x=0, xref="paper", y=90, text="90 %", showarrow=False, xanchor="left", yshift=8, font={"size": 11, "color": QUIET}
    )  # fmt: skip
    return figure
