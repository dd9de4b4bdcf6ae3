"""The amplitudes of a multisine against the flat spectrum."""

from __future__ import annotations

import plotly.graph_objects as go

from flexcal.data import MultisinePlan
from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, NOMINAL


def amplitude_spectrum(plan: MultisinePlan, flat: MultisinePlan) -> go.Figure:
    """Torque (N m) of every line of each excited axis, one panel an axis."""
    axes = len(plan.joints)
    figure = panels(axes, 1, 60 + 150 * axes, [f"axis {joint + 1}" for joint in plan.joints], row_gap=0.09)
    for k in range(axes):
        for name, source, colour, width in (("flat", flat, NOMINAL, 1.6), ("planned", plan, ELASTIC, 2.0)):
            figure.add_trace(
                go.Scatter(
                    x=single(source.frequencies_hz),
                    y=single(source.amplitude[k]),
                    name=name,
                    legendgroup=name,
                    showlegend=k == 0,
                    mode="lines",
                    line={"color": colour, "width": width, "shape": "hvh"},
                    hovertemplate="%{x:.2f} Hz: %{y:.2f} N m",
                ),
                row=k + 1,
                col=1,
            )
    figure.update_yaxes(rangemode="tozero")
    figure.update_yaxes(title_text="amplitude of a line / N m", row=(axes + 1) // 2, col=1)
    figure.update_xaxes(title_text="Hz", row=axes, col=1)
    return figure
