"""Cumulative sums over visits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import ELASTIC, INK, NOMINAL, RIGID, Figure, as_float32, canvas, trace

_COLOURS = (ELASTIC, RIGID, NOMINAL, INK)
_DASHES = ("solid", "dash", "dot", "dashdot")


def cumulative_sums(drift: Mapping[str, Any]) -> Figure:
    """Upward sums of every subject above zero and downward ones below, against the visits, with the limits of an alarm; `drift` as in
    results.json.
    """
    figure = canvas(420)
    visits = list(range(1, len(drift["visits"]) + 1))
    for k, (subject, item) in enumerate(drift["sums"].items()):
        line = {
            "color": _COLOURS[k % len(_COLOURS)],
            "dash": _DASHES[k // len(_COLOURS) % len(_DASHES)],
            "width": 2,
        }
        for sign, key in ((1, "upward"), (-1, "downward")):
            figure.add_trace(
                trace(
                    "scatter",
                    x=visits, y=as_float32([sign * v for v in item[key]]), mode="lines+markers", name=subject, line=line,
                    marker={"size": 5}, legendgroup=subject, showlegend=sign == 1, text=drift["visits"],
                    hovertemplate="%{text}: %{y:.2f}<extra>%{fullData.name}</extra>",
                )
            )  # fmt: skip
    for sign in (1, -1):
        figure.add_hline(y=sign * drift["limit"], line={"color": INK, "dash": "dash", "width": 1})
    figure.update_xaxes(title_text="visit", dtick=max(1, len(visits) // 12))
    figure.update_yaxes(title_text="cumulative sum / standard deviations")
    return figure


def visit_errors(each: list[Mapping[str, Any]]) -> Figure:
    """Distances between measured and expected points of a visit, mm, beside those expected of a robot as calibrated; items of
    `recheck.each`.
    """
    figure = canvas(340)
    labels = [f"{item['pose']} {item['target']}" for item in each]
    for name, key, colour in (
        ("measured", "distance_mm", ELASTIC),
        ("expected (root mean square)", "expected_mm", NOMINAL),
    ):
        figure.add_trace(
            trace(
                "bar",
                x=labels,
                y=as_float32([item[key] for item in each]),
                name=name,
                marker={"color": colour},
                hovertemplate="pose %{x}: %{y:.4f} mm<extra>%{fullData.name}</extra>",
            )
        )
    figure.update_xaxes(title_text="pose and point", type="category")
    figure.update_yaxes(title_text="distance / mm", rangemode="tozero")
    return figure
