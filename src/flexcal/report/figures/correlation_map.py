"""Correlations of estimated parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, PAGE, RIGID


def correlation_map(names: Sequence[str], correlation: np.ndarray) -> go.Figure:
    """Correlation (p, p) of the errors of the parameters `names`, from -1 to 1."""
    figure = canvas(620, legend=False)
    figure.add_trace(
        go.Heatmap(
            x=list(names),
            y=list(names),
            z=single(correlation),
            zmin=-1,
            zmax=1,
            colorscale=[[0, RIGID], [0.5, PAGE], [1, ELASTIC]],
            colorbar={"thickness": 12, "outlinewidth": 0, "tickvals": [-1, -0.5, 0, 0.5, 1]},
            hovertemplate="%{y}<br>%{x}<br>%{z:.2f}<extra></extra>",
        )
    )
    figure.update_xaxes(
        showticklabels=False, ticks="", title_text="base parameters, in the order of the table"
    )
    figure.update_yaxes(showticklabels=False, ticks="", autorange="reversed")
    return figure
