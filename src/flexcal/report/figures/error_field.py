"""The error vector over the working volume, component by component."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import ELASTIC, INK
from flexcal.units import MILLIMETRE

_BINS = 10
_SHOWN = 0.998
"""Quantile of the sizes that the axis spans: single outliers would flatten the rest."""


def error_field(position: np.ndarray, residuals: np.ndarray) -> go.Figure:
    """Components (mm) of residuals (N, 3) m against the coordinates (m) of the points (N, 3), with means in ten bins of equal count.

    Rows are components of the error, columns coordinates of the point, both in the instrument's frame.
    """
    figure = panels(3, 3, 600, legend=True, row_gap=0.04)
    largest = 1.15 * float(np.quantile(np.abs(residuals), _SHOWN)) / MILLIMETRE
    for component, name in enumerate("xyz"):
        for axis, along in enumerate("xyz"):
            row, column = component + 1, axis + 1
            first = component == 0 and axis == 0
            error = residuals[:, component] / MILLIMETRE
            figure.add_trace(
                go.Scatter(
                    x=single(position[:, axis]), y=single(error), mode="markers", name="error", legendgroup="error",
                    showlegend=first, marker={"color": ELASTIC, "size": 3.5, "opacity": 0.4},
                    hovertemplate=f"{along} %{{x:.3f}} m: %{{y:+.3f}} mm in {name}",
                ), row=row, col=column,
            )  # fmt: skip
            centres, means = _means(position[:, axis], error)
            figure.add_trace(
                go.Scatter(
                    x=single(centres), y=single(means), mode="lines+markers", name="mean", legendgroup="mean",
                    showlegend=first, line={"color": INK, "width": 1.6}, marker={"size": 4}, hoverinfo="skip",
                ), row=row, col=column,
            )  # fmt: skip
            figure.update_xaxes(nticks=5, showticklabels=component == 2, row=row, col=column)
            figure.update_yaxes(
                range=[-largest, largest], nticks=5, showticklabels=axis == 0, row=row, col=column
            )
            if component == 2:
                figure.update_xaxes(title_text=f"{along} / m", row=row, col=column)
        figure.update_yaxes(title_text=f"error in {name} / mm", row=component + 1, col=1)
    return figure


def _means(values: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    parts = np.array_split(np.argsort(values, kind="stable"), min(_BINS, max(1, len(values) // 5)))
    return np.array([values[p].mean() for p in parts]), np.array([errors[p].mean() for p in parts])
