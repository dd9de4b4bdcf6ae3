"""Predicted standard deviations of the springs."""

from __future__ import annotations

from collections.abc import Mapping

import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.notation import spring_label
from flexcal.report.palette import ELASTIC, NOMINAL


def predicted_springs(planned: Mapping[str, float], flat: Mapping[str, float]) -> go.Figure:
    """Predicted standard deviation (per cent, logarithmic) of every stiffness and damping, beside that with a flat spectrum."""
    stiffness = [name for name in planned if name.endswith(".stiffness")]
    figure = panels(1, 2, 90 + 34 * len(stiffness), ["stiffness", "damping"])
    for column, names in enumerate((stiffness, [n for n in planned if n not in stiffness]), start=1):
        for name, std, colour in (("flat", flat, NOMINAL), ("planned", planned, ELASTIC)):
            figure.add_trace(
                go.Scatter(
                    x=single([100 * std[n] for n in names]),
                    y=[spring_label(n) for n in names],
                    name=name,
                    legendgroup=name,
                    showlegend=column == 1,
                    mode="markers",
                    marker={"color": colour, "size": 9},
                    hovertemplate="%{y}: %{x:.2f} %",
                ),
                row=1,
                col=column,
            )
    ticks = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100]
    figure.update_xaxes(
        type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks], title_text="standard deviation / %"
    )
    figure.update_yaxes(autorange="reversed")
    figure.update_yaxes(showticklabels=False, col=2)
    return figure
