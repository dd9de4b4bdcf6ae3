"""Stiffnesses and dampings with their 95 % intervals, relative to a reference (Table 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.estimation import Estimate
from flexcal.report.figures.canvas import panels, single
from flexcal.report.notation import spring_label
from flexcal.report.palette import AXIS, ELASTIC, QUIET

_WIDEST = 1.0


def spring_intervals(
    estimate: Estimate,
    stiffness: Sequence[str],
    damping: Sequence[str],
    reference: Mapping[str, float],
    word: str,
) -> go.Figure:
    """Estimate/reference - 1 in percent with 95 % intervals; `word` says what the reference is. Unidentifiable ones are named."""
    figure = panels(
        2, 1, 90 + 24 * (len(stiffness) + len(damping)), ["stiffness", "damping"], legend=False, row_gap=0.13
    )
    for row, names in enumerate((stiffness, damping), start=1):
        known = [name for name in names if estimate.interval(name) is not None and name in reference]
        centre = np.array([estimate.values[name] / reference[name] - 1 for name in known])
        ends = np.array([estimate.interval(name) for name in known], dtype=float).reshape(-1, 2)
        base = np.array([reference[name] for name in known])
        figure.add_trace(
            go.Scatter(
                x=single(100 * centre),
                y=[spring_label(name) for name in known],
                error_x={
                    "type": "data",
                    "array": single(100 * (ends[:, 1] / base - 1 - centre)),
                    "arrayminus": single(100 * (centre - ends[:, 0] / base + 1)),
                    "color": ELASTIC,
                    "thickness": 2,
                    "width": 4,
                },
                mode="markers",
                marker={"color": ELASTIC, "size": 8},
                hovertemplate="%{y}: %{x:+.2f} %",
                name="estimate with 95 % interval",
            ),
            row=row,
            col=1,
        )
        for name in names:
            if name not in known:
                figure.add_trace(
                    go.Scatter(
                        x=[0],
                        y=[spring_label(name)],
                        mode="text",
                        text=[
                            "not determined by these data"
                            if estimate.interval(name) is None
                            else f"no {word.removeprefix('the ')} to compare"
                        ],
                        textfont={"color": QUIET, "size": 12},
                        hoverinfo="skip",
                    ),
                    row=row,
                    col=1,
                )
        spread = np.abs(100 * np.concatenate([ends[:, 0] / base - 1, ends[:, 1] / base - 1, centre]))
        widest = min(100 * _WIDEST, 1.1 * float(spread.max(initial=1.0)))
        figure.update_xaxes(range=[-widest, widest], ticksuffix=" %", row=row, col=1)
        figure.update_yaxes(
            categoryorder="array",
            categoryarray=[spring_label(name) for name in reversed(names)],
            range=[-0.7, len(names) - 0.3],
            row=row,
            col=1,
        )
    figure.add_vline(x=0, line={"color": AXIS, "width": 1.5})
    figure.update_xaxes(title_text=f"difference from {word}", row=2, col=1)
    return figure
