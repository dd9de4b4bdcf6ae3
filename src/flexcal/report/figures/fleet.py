"""Figures of a fleet: errors of all robots beside their tolerances, and courses over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    NOMINAL,
    RIGID,
    Figure,
    as_float32,
    canvas,
    millimetre_axis,
    panels,
    scaled,
    trace,
)
from flexcal.report.results import TOLERANCE_STATES

_LOOK = {
    "out": (RIGID, "x"),
    "undecided": (RIGID, "circle-open"),
    "within": (ELASTIC, "circle"),
    "not_judged": (NOMINAL, "circle-open"),
}


def fleet_errors(robots: Sequence[Mapping[str, Any]]) -> Figure:
    """P90 (mm, log scale) of verified robots in the order of its size, with 95 % intervals, and their tolerances."""
    ordered = sorted(robots, key=lambda robot: robot["p90_mm"])
    figure = canvas(420)
    for state, (colour, symbol) in _LOOK.items():
        places = [k for k, robot in enumerate(ordered, 1) if robot["state"] == state]
        if not places:
            continue
        shown = [ordered[k - 1] for k in places]
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(places),
                y=as_float32([robot["p90_mm"] for robot in shown]),
                error_y={
                    "type": "data",
                    "array": as_float32([1.96 * robot["p90_std_mm"] for robot in shown]),
                    "color": AXIS,
                    "thickness": 1,
                    "width": 0,
                },
                mode="markers",
                marker={"color": colour, "symbol": symbol, "size": 7},
                name=TOLERANCE_STATES[state],
                text=[_text(robot["robot"]) for robot in shown],
                hovertemplate="%{text}: P90 %{y:.3f} mm<extra></extra>",
            )
        )
    limited = [(k, robot["tolerance_mm"]) for k, robot in enumerate(ordered, 1) if robot["tolerance_mm"]]
    if limited:
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32([k for k, _ in limited]),
                y=as_float32([tolerance for _, tolerance in limited]),
                mode="markers",
                marker={"color": AXIS, "symbol": "line-ew-open", "size": 9},
                name="tolerance",
                hovertemplate="tolerance %{y:.3f} mm<extra></extra>",
            )
        )
    millimetre_axis(figure, title="P90 of errors / mm")
    figure.update_xaxes(title_text="robots, by their P90", rangemode="tozero")
    return figure


def trend_courses(titles: Sequence[str], trends: Sequence[Mapping[str, Any]]) -> Figure:
    """Small panels of values over time with 95 % intervals, and the fitted lines; `trends` as in the document of the verb."""
    columns = min(2, len(trends))
    rows = -(-len(trends) // columns)
    figure = panels(rows, columns, 90 + 200 * rows, [_text(title) for title in titles], legend=False)
    for k, trend in enumerate(trends):
        factor, unit = scaled(trend["unit"])
        row, column = k // columns + 1, k % columns + 1
        figure.add_trace(
            trace(
                "scatter",
                x=list(trend["dates"]),
                y=as_float32([factor * value for value in trend["values"]]),
                error_y={
                    "type": "data",
                    "array": as_float32([1.96 * factor * std for std in trend["std"]]),
                    "color": AXIS,
                    "thickness": 1,
                    "width": 0,
                },
                mode="markers",
                marker={"color": ELASTIC, "size": 7},
                hovertemplate=f"%{{x|%Y-%m-%d}}: %{{y:.4g}} {unit}<extra></extra>",
            ),
            row,
            column,
        )
        figure.add_trace(
            trace(
                "scatter",
                x=[trend["first"], trend["last"]],
                y=as_float32([factor * value for value in trend["line"]]),
                mode="lines",
                line={"color": RIGID, "width": 2},
                hoverinfo="skip",
            ),
            row,
            column,
        )
        figure.update_xaxes(type="date", tickformat="%Y-%m", nticks=4, row=row, col=column)
        figure.update_yaxes(title_text=unit, row=row, col=column)
    return figure


def _text(name: str) -> str:
    """Name from a file for a figure, whose texts may hold markup."""
    return name.replace("&", "&amp;").replace("<", "&lt;")
