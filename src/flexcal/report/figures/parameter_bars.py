"""Geometric parameters as bars with their intervals, in units of manufacturing tolerance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.calibration.terms import TOLERANCE
from flexcal.estimation import Estimate
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import AXIS, ELASTIC, INK


def shown_parameters(estimate: Estimate, names: Sequence[str]) -> list[str]:
    """The named parameters that have an interval and a tolerance, without the place of the instrument."""
    return [
        name
        for name in names
        if not name.startswith("station.")
        and estimate.parameters[name].unit in TOLERANCE
        and estimate.interval(name) is not None
    ]


def parameter_bars(estimate: Estimate, names: Sequence[str], axis: str) -> go.Figure:
    """Estimates and 95 % intervals of `shown_parameters`, over 0.3 mm, 0.5 mrad or 1 µrad/(N m) by unit; `axis` is the axis title."""
    chosen = shown_parameters(estimate, names)
    tolerance = np.array([TOLERANCE[estimate.parameters[name].unit] for name in chosen])
    value = np.array([estimate.values[name] for name in chosen]) / tolerance
    ends = (
        np.array([estimate.interval(name) for name in chosen], dtype=float).reshape(-1, 2)
        / tolerance[:, None]
    )
    figure = canvas(90 + 17 * len(chosen), legend=False)
    figure.add_trace(
        go.Bar(
            x=single(value), y=chosen, orientation="h", marker={"color": ELASTIC, "opacity": 0.75},
            error_x={
                "type": "data", "symmetric": False, "array": single(ends[:, 1] - value),
                "arrayminus": single(value - ends[:, 0]), "color": INK, "thickness": 1.2, "width": 3,
            },
            hovertemplate="%{y}: %{x:+.2f}<extra></extra>",
        )
    )  # fmt: skip
    for limit in (-1, 1):
        figure.add_vline(x=limit, line={"color": AXIS, "width": 1, "dash": "dot"})
    figure.update_layout(bargap=0.35)
    figure.update_xaxes(title_text=axis)
    figure.update_yaxes(autorange="reversed", ticks="", tickfont={"size": 11}, dtick=1)
    return figure
