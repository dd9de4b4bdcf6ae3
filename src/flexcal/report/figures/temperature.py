"""Residuals away from the robot's base against temperature."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.report.layout import ELASTIC, INK, Figure, as_float32, panels, trace
from flexcal.units import MILLIMETRE


def residual_growth(temperature: np.ndarray, outward: Mapping[str, np.ndarray]) -> Figure:
    """Residuals (N,), m, in the direction away from the base, of several models by label, against temperatures (N,), with lines."""
    figure = panels(len(outward), 1, 60 + 190 * len(outward), list(outward), row_gap=0.12)
    ends = np.array([temperature.min(), temperature.max()])
    largest = 1.08 * max(float(np.abs(own).max()) for own in outward.values()) / MILLIMETRE
    for row, own in enumerate(outward.values(), 1):
        slope, start = np.polyfit(temperature, own / MILLIMETRE, 1)
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(temperature), y=as_float32(own / MILLIMETRE), mode="markers", name="residual", showlegend=row == 1,
                legendgroup="a", marker={"color": ELASTIC, "size": 4, "opacity": 0.6}, hovertemplate="%{x:.1f} °C: %{y:+.3f} mm",
            ), row=row, col=1,
        )  # fmt: skip
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(ends), y=as_float32(start + slope * ends), mode="lines", name="fitted line", showlegend=row == 1,
                legendgroup="b", line={"color": INK, "width": 1.6}, hoverinfo="skip",
            ), row=row, col=1,
        )  # fmt: skip
        figure.update_xaxes(showticklabels=row == len(outward), row=row, col=1)
    figure.update_yaxes(range=[-largest, largest], nticks=5, title_text="outward / mm")
    figure.update_xaxes(title_text="temperature / °C", row=len(outward), col=1)
    return figure
