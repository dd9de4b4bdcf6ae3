"""Distributions over the tasks of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    NOMINAL,
    QUIET,
    RIGID,
    Figure,
    as_float32,
    canvas,
    millimetre_axis,
    trace,
)

_DRAWN = 400
"""Points of a curve at most."""


def task_distribution(errors: Mapping[str, np.ndarray]) -> Figure:
    """Share of tasks (percent) whose error, mm, is at most that of the axis, by kind of error."""
    figure = canvas(380)
    for (name, values), colour in zip(errors.items(), _colours(len(errors)), strict=True):
        ordered = np.sort(values[np.isfinite(values) & (values > 0)])
        if not len(ordered):
            continue
        shares = np.linspace(0, 1, min(_DRAWN, len(ordered)))
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(np.quantile(ordered, shares)), y=as_float32(100 * shares), mode="lines", name=name,
                line={"color": colour, "width": 2.5},
                hovertemplate="%{y:.0f} % of tasks within %{x:.3f} mm<extra>%{fullData.name}</extra>",
            )
        )  # fmt: skip
    millimetre_axis(figure, "x", "90th percentile of a task's errors / mm")
    figure.update_yaxes(title_text="share of tasks", ticksuffix=" %", range=[0, 104])
    return figure


def level_distributions(levels: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """Boxes of the errors, mm, of the tasks with each value of an option: quartiles, and whiskers at 2.5 and 97.5 %."""
    figure = canvas(320, legend=False)
    for name, values in levels:
        own = values[np.isfinite(values) & (values > 0)]
        if not len(own):
            continue
        low, first, middle, third, high = np.quantile(own, [0.025, 0.25, 0.5, 0.75, 0.975])
        figure.add_trace(
            trace(
                "box",
                x=[name], lowerfence=[low], q1=[first], median=[middle], q3=[third], upperfence=[high],
                line={"color": ELASTIC, "width": 1.5}, fillcolor="rgba(0,0,0,0)", name=name,
            )
        )  # fmt: skip
    millimetre_axis(figure, "y", "90th percentile / mm")
    figure.update_xaxes(type="category")
    return figure


def interval_coverage(names: Sequence[str], share: np.ndarray, low: np.ndarray, high: np.ndarray) -> Figure:
    """Coverage (percent) of the 95 % intervals of every parameter, with the intervals of these shares, and the promised 95 %."""
    figure = canvas(60 + 16 * len(names), legend=False)
    places = list(range(len(names)))
    figure.add_trace(
        trace(
            "scatter",
            x=as_float32(100 * share), y=places, mode="markers", marker={"color": ELASTIC, "size": 7},
            error_x={
                "type": "data", "symmetric": False, "array": as_float32(100 * (high - share)),
                "arrayminus": as_float32(100 * (share - low)), "color": QUIET, "thickness": 1.2, "width": 0,
            },
            text=list(names), hovertemplate="%{text}: %{x:.1f} %<extra></extra>",
        )
    )  # fmt: skip
    figure.add_vline(x=95, line={"color": AXIS, "width": 1.5, "dash": "dash"})
    figure.update_yaxes(tickvals=places, ticktext=list(names), autorange="reversed", tickfont={"size": 10})
    figure.update_xaxes(
        title_text="intervals that hold the true value",
        ticksuffix=" %",
        range=[min(80.0, 100 * float(low.min())), 101],
    )
    return figure


def _colours(count: int) -> list[str]:
    chosen = [ELASTIC, RIGID, NOMINAL, QUIET, AXIS]
    return [chosen[k % len(chosen)] for k in range(count)]
