"""Displacement of the barycentre and repeatability of poses over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, INK, NOMINAL, RIGID

_HOUR, _MINUTE = 3600.0, 60.0
_COLOURS = (ELASTIC, RIGID, NOMINAL, INK)
_DASHES = ("solid", "dash", "dot")


def pose_courses(drifting: Sequence[Mapping[str, Any]]) -> go.Figure:
    """Way of the barycentre and RP (mm) of the sets of every pose, items of `drift.each`, against time from the first set of all."""
    start = min(item["t_s"][0] for item in drifting)
    longest = max(item["t_s"][-1] for item in drifting) - start
    unit, word = (_HOUR, "h") if longest > 2 * _HOUR else (_MINUTE, "min")
    figure = panels(
        2, 1, 460, ["displacement of the barycentre from that of the first set / mm", "RP / mm"], row_gap=0.16
    )
    for k, item in enumerate(drifting):
        line = {
            "color": _COLOURS[k % len(_COLOURS)],
            "dash": _DASHES[k // len(_COLOURS) % len(_DASHES)],
            "width": 2,
        }
        for row, key in enumerate(("way_mm", "rp_mm"), start=1):
            figure.add_trace(
                go.Scatter(
                    x=single([(t - start) / unit for t in item["t_s"]]), y=single(item[key]), mode="lines+markers",
                    name=f"pose {item['pose']}", line=line, marker={"size": 5}, legendgroup=str(k), showlegend=row == 1,
                    hovertemplate=f"%{{x:.2f}} {word}: %{{y:.4f}} mm",
                ), row=row, col=1,
            )  # fmt: skip
    figure.update_xaxes(showticklabels=False, row=1, col=1)
    figure.update_xaxes(title_text=f"time / {word}", row=2, col=1)
    figure.update_yaxes(rangemode="tozero", nticks=6)
    return figure
