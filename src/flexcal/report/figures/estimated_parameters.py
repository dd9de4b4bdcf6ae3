"""Estimated parameters: intervals, singular values, correlations, and selection of terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration import fit
from flexcal.estimation import Estimate
from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    INK,
    NOMINAL,
    PAGE,
    QUIET,
    RIGID,
    Figure,
    as_float32,
    canvas,
    log_ticks,
    panels,
    spring_label,
    trace,
)
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.calibration.term_selection import TermComparison


def shown_parameters(estimate: Estimate, names: Sequence[str]) -> list[str]:
    """The named parameters that have an interval and a tolerance, without the place of the instrument."""
    return [
        name
        for name in names
        if not name.startswith("station.")
        and estimate.parameters[name].unit in fit.TOLERANCE
        and estimate.interval(name) is not None
    ]


def parameter_bars(estimate: Estimate, names: Sequence[str], axis: str) -> Figure:
    """Estimates and 95 % intervals of `shown_parameters`, over 0.3 mm, 0.5 mrad or 1 µrad/(N m) by unit; `axis` is the axis title."""
    chosen = shown_parameters(estimate, names)
    tolerance = np.array([fit.TOLERANCE[estimate.parameters[name].unit] for name in chosen])
    value = np.array([estimate.values[name] for name in chosen]) / tolerance
    ends = (
        np.array([estimate.interval(name) for name in chosen], dtype=float).reshape(-1, 2)
        / tolerance[:, None]
    )
    figure = canvas(90 + 17 * len(chosen), legend=False)
    figure.add_trace(
        trace(
            "bar",
            x=as_float32(value), y=chosen, orientation="h", marker={"color": ELASTIC, "opacity": 0.75},
            error_x={
                "type": "data", "symmetric": False, "array": as_float32(ends[:, 1] - value),
                "arrayminus": as_float32(value - ends[:, 0]), "color": INK, "thickness": 1.2, "width": 3,
            },
            hovertemplate="%{y}: %{x:+.2f}<extra></extra>",
        )
    )  # fmt: skip
    for limit in (-1, 1):
        figure.add_vline(x=limit, line={"color": AXIS, "width": 1, "dash": "dot"})
    figure.update_layout(bargap=0.35)
    figure.update_xaxes(title_text=axis)
    figure.update_yaxes(autorange="reversed", ticks="", tickfont={"size": 11}, dtick=1)
    return figure


_WIDEST = 1.0


def spring_intervals(
    estimate: Estimate,
    stiffness: Sequence[str],
    damping: Sequence[str],
    reference: Mapping[str, float],
    word: str,
) -> Figure:
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
            trace(
                "scatter",
                x=as_float32(100 * centre),
                y=[spring_label(name) for name in known],
                error_x={
                    "type": "data",
                    "array": as_float32(100 * (ends[:, 1] / base - 1 - centre)),
                    "arrayminus": as_float32(100 * (centre - ends[:, 0] / base + 1)),
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
                    trace(
                        "scatter",
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


_SMALLEST = 1e-17


def singular_values(values: np.ndarray, diagonal: np.ndarray, rank: int, gap: float) -> Figure:
    """Singular `values` and |`diagonal` of R| (p,) of the scaled Jacobian, relative to the largest; `rank` and `gap` marked."""
    figure = canvas(400)
    number = np.arange(1, len(values) + 1)
    for name, sizes, symbol in (
        ("diagonal of R (pivoted QR)", diagonal, "circle"),
        ("singular values", values, "line-ew-open"),
    ):
        kept = number <= rank
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(number),
                y=as_float32(np.maximum(sizes, _SMALLEST)),
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
    figure.update_yaxes({"type": "log", "title": {"text": "relative to the largest"}} | log_ticks(-18, 0, 3))
    figure.update_xaxes(title_text="number")
    return figure


def correlation_map(names: Sequence[str], correlation: np.ndarray) -> Figure:
    """Correlation (p, p) of the errors of the parameters `names`, from -1 to 1."""
    figure = canvas(620, legend=False)
    figure.add_trace(
        trace(
            "heatmap",
            x=list(names),
            y=list(names),
            z=as_float32(correlation),
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


def term_scores(rows: Sequence[TermComparison], by: str = "folds") -> Figure:
    """Mean error (mm) on left-out poses by term: of whole "folds" in measuring order and in the workspace, of single "poses", or of whole
    "places" of a fixture.
    """
    rows = [row for row in rows if np.isfinite(row.order)]
    labels = [term_label(row) for row in rows]
    figure = canvas(120 + 46 * len(labels))
    series = {
        "left out by place in the workspace": ([row.workspace for row in rows], ELASTIC),
        "left out by measuring order": ([row.order for row in rows], NOMINAL),
    }
    if by == "poses":
        series = {"left out one by one": ([row.single for row in rows], ELASTIC)}
    elif by == "places":
        series = {"left out by place of the fixture": ([row.order for row in rows], ELASTIC)}
    for name, (values, colour) in series.items():
        figure.add_trace(
            trace(
                "bar",
                x=as_float32(np.array(values) / MILLIMETRE), y=labels, orientation="h", name=name, marker={"color": colour},
                text=[f"{v / MILLIMETRE:.4f}" for v in values], textposition="auto", insidetextanchor="end", textangle=0,
                insidetextfont={"size": 11, "color": PAGE}, outsidetextfont={"size": 11, "color": INK}, hovertemplate="%{y}: %{x:.4f} mm",
            )
        )  # fmt: skip
    figure.update_layout(bargap=0.3, bargroupgap=0.08, barmode="group")
    figure.update_xaxes(title_text="mean error on left-out poses / mm", rangemode="tozero")
    figure.update_yaxes(autorange="reversed", ticks="")
    return figure


def term_label(row: TermComparison) -> str:
    """The base terms, or what a term adds to them."""
    if row.term is None:
        return " + ".join(row.terms)
    return f"{'+ ' if row.taken else 'left: '}{row.term.replace('_', ' ')}"
