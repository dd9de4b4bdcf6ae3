"""Singular values of the identification Jacobian, and the gap at the rank."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import canvas, decades, single
from flexcal.report.palette import AXIS, ELASTIC, NOMINAL, QUIET

_SMALLEST = 1e-17


def singular_values(values: np.ndarray, diagonal: np.ndarray, rank: int, gap: float) -> go.Figure:
    """Singular `values` and |`diagonal` of R| (p,) of the scaled Jacobian, relative to the largest; `rank` and `gap` marked."""
    figure = canvas(400)
    number = np.arange(1, len(values) + 1)
    for name, sizes, symbol in (
        ("diagonal of R (pivoted QR)", diagonal, "circle"),
        ("singular values", values, "line-ew-open"),
    ):
        kept = number <= rank
        figure.add_trace(
            go.Scatter(
                x=single(number),
                y=single(np.maximum(sizes, _SMALLEST)),
                mode="markers",
                marker={
                    "color": [ELASTIC if k else NOMINAL for k in kept],
                    "size": 7 if symbol == "circle" else 11,
                    "symbol": symbol,
                    "line": {
                        "width": 0 if symbol == "circle" else 2,
                        "color": [ELASTIC if k else NOMINAL for k in kept],
                    },
                },
                name=name,
                hovertemplate="%{x}: %{y:.1e}",
            )
        )
    if rank < len(values):
        figure.add_vline(x=rank + 0.5, line={"color": AXIS, "width": 1.5, "dash": "dash"})
        below = f"a gap of {gap:.0f} decades" if np.isfinite(gap) else "nothing below"
        figure.add_annotation(
            x=rank + 0.5, y=0.98, yref="paper", text=f"rank {rank}, {below}", showarrow=False,
            xanchor="right", xshift=-6, yanchor="top", font={"color": QUIET, "size": 12}, yshift=-150,
        )  # fmt: skip
    figure.update_yaxes({"type": "log", "title": {"text": "relative to the largest"}} | decades(-18, 0, 3))
    figure.update_xaxes(title_text="number")
    return figure
