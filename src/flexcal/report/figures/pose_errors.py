"""Errors pose by pose: at calibration and verification poses, by coordinate, and over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import PredictionErrors
from flexcal.data.poses import PoseSet
from flexcal.report.layout import (
    ELASTIC,
    INK,
    NOMINAL,
    QUIET,
    RIGID,
    Figure,
    as_float32,
    canvas,
    millimetre_axis,
    panels,
    positive,
    trace,
)
from flexcal.units import MILLIMETRE


def calibration_errors(poses: PoseSet, before: np.ndarray, after: np.ndarray) -> Figure:
    """Distances in millimetres (log scale) of the error vectors `before` and `after` (N, 3) m, against the number of the pose."""
    figure = canvas(380)
    for name, errors, colour, symbol in (
        ("before, the robot's own", before, NOMINAL, "diamond"),
        ("calibrated", after, ELASTIC, "circle"),
    ):
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(poses.pose),
                y=positive(np.linalg.norm(errors, axis=1) / MILLIMETRE),
                mode="markers",
                marker={"color": colour, "size": 7 if len(poses) <= 200 else 4, "symbol": symbol},
                name=name,
                hovertemplate="pose %{x}: %{y:.3f} mm",
            )
        )
    millimetre_axis(figure)
    figure.update_xaxes(title_text="calibration pose")
    return figure


def error_components(poses: PoseSet, residuals: np.ndarray) -> Figure:
    """Components x, y, z of the residuals (N, 3) m in millimetres, one panel each, with the instrument's ± 2σ around them."""
    figure = panels(3, 1, 470, ["x", "y", "z"], row_gap=0.08)
    noise = 2 * poses.sigma / MILLIMETRE
    largest = 1.1 * max(float(np.abs(residuals).max(initial=1e-9)) / MILLIMETRE, float(noise.max()))
    for k in range(3):
        for sign in (1, -1):
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32(poses.pose),
                    y=as_float32(sign * noise[:, k]),
                    line={"width": 1.2, "dash": "dot", "color": QUIET},
                    mode="lines",
                    name="± 2σ of the instrument",
                    legendgroup="noise",
                    showlegend=k == 0 and sign > 0,
                    hoverinfo="skip",
                ),
                row=k + 1,
                col=1,
            )
        figure.add_trace(
            trace(
                "bar",
                x=as_float32(poses.pose),
                y=as_float32(residuals[:, k] / MILLIMETRE),
                marker={"color": ELASTIC, "line": {"width": 0}},
                width=0.6,
                name="measured minus predicted",
                legendgroup="residual",
                showlegend=k == 0,
                hovertemplate="pose %{x}: %{y:+.3f} mm",
            ),
            row=k + 1,
            col=1,
        )
        figure.update_xaxes(showticklabels=k == 2, row=k + 1, col=1)
    figure.update_yaxes(range=[-largest, largest], nticks=5)
    figure.update_yaxes(title_text="error / mm", row=2, col=1)
    figure.update_xaxes(title_text="calibration pose", row=3, col=1)
    return figure


@dataclass(frozen=True, eq=False)
class ErrorSeries:
    """One model's errors (N, 3) m on common poses, with the name and colour under which they are drawn."""

    name: str
    colour: str
    errors: np.ndarray

    @property
    def millimetres(self) -> np.ndarray:
        """Distances (N,)."""
        return np.linalg.norm(self.errors, axis=1) / MILLIMETRE


def verification_errors(
    poses: PoseSet, series: Sequence[ErrorSeries], calibrated: PredictionErrors, paper: ErrorStatistics | None
) -> Figure:
    """Distances in millimetres (log scale) against the number of the pose; poses with an uncertain flank are ringed."""
    figure = canvas(420)
    for item in series:
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(poses.pose),
                y=positive(item.millimetres),
                mode="markers",
                marker={"color": item.colour, "size": 6 if len(poses) <= 200 else 4},
                name=item.name,
                hovertemplate="pose %{x}: %{y:.3f} mm",
            )
        )
    unclear = calibrated.ambiguous
    if unclear.any():
        distance = np.linalg.norm(calibrated.errors, axis=1) / MILLIMETRE
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(poses.pose[unclear]),
                y=positive(distance[unclear]),
                mode="markers",
                marker={
                    "color": ELASTIC,
                    "size": 14,
                    "symbol": "circle-open",
                    "line": {"width": 2, "color": INK},
                },
                name="backlash flank uncertain",
                hovertemplate="pose %{x}: %{y:.3f} mm, backlash flank uncertain",
            )
        )
    if paper is not None:
        ends = as_float32([poses.pose.min(), poses.pose.max()])
        for value, share, dash in ((paper.p90, "90 %", "dot"), (paper.max, "worst", "dash")):
            if np.isfinite(value):
                name = f"paper, {share}"
                line = {"color": INK, "width": 1.2, "dash": dash}
                both = as_float32(np.full(2, value / MILLIMETRE))
                figure.add_trace(
                    trace("scatter", x=ends, y=both, mode="lines", line=line, name=name, hoverinfo="name+y")
                )
    millimetre_axis(figure)
    figure.update_xaxes(title_text="verification pose")
    return figure


_HOUR, _MINUTE = 3600.0, 60.0
_COLOURS = (ELASTIC, RIGID, NOMINAL, INK)
_DASHES = ("solid", "dash", "dot")


def pose_courses(drifting: Sequence[Mapping[str, Any]]) -> Figure:
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
                trace(
                    "scatter",
                    x=as_float32([(t - start) / unit for t in item["t_s"]]), y=as_float32(item[key]), mode="lines+markers",
                    name=f"pose {item['pose']}", line=line, marker={"size": 5}, legendgroup=str(k), showlegend=row == 1,
                    hovertemplate=f"%{{x:.2f}} {word}: %{{y:.4f}} mm",
                ), row=row, col=1,
            )  # fmt: skip
    figure.update_xaxes(showticklabels=False, row=1, col=1)
    figure.update_xaxes(title_text=f"time / {word}", row=2, col=1)
    figure.update_yaxes(rangemode="tozero", nticks=6)
    return figure
