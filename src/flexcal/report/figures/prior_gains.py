"""Predicted standard deviations after planned measurements, relative to the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import canvas, decades, positive
from flexcal.report.palette import ELASTIC


def prior_gains(names: Sequence[str], after: np.ndarray) -> go.Figure:
    """Standard deviation (p,) after the measurements relative to that before, logarithmic; the lower, the more was learned."""
    order = np.argsort(after)[::-1]
    figure = canvas(80 + 17 * len(names), legend=False)
    figure.add_trace(
        go.Scatter(
            x=positive(after[order]),
            y=[names[k] for k in order],
            mode="markers",
            marker={"color": ELASTIC, "size": 7},
            hovertemplate="%{y}: %{x:.3g} of the prior standard deviation<extra></extra>",
        )
    )
    low = int(np.floor(np.log10(max(float(after.min(initial=1.0)), 1e-9))))
    figure.update_xaxes(decades(low, 0))
    figure.update_xaxes(type="log", range=[low, 0.1], title_text="standard deviation, relative to before")
    return figure
