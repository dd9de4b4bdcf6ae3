"""Observed errors against predicted quantiles."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from flexcal.calibration import Verification
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import AXIS, ELASTIC, INK
from flexcal.units import MILLIMETRE


def predicted_quantiles(verification: Verification) -> go.Figure:
    """Quantiles of the observed distance against those predicted from parameters and scatter, in millimetres.

    Poses with an uncertain flank are left out: the
    covariance knows nothing of a wrong flank.
    """
    clear = ~verification.ambiguous
    observed = np.sort(np.linalg.norm(verification.errors[clear], axis=1)) / MILLIMETRE
    expected = expected_quantiles(verification.expected_rms[clear]) / MILLIMETRE
    largest = 1.06 * max(float(observed.max(initial=1e-3)), float(expected.max(initial=1e-3)))
    figure = canvas(400)
    figure.add_trace(
        go.Scatter(
            x=[0, largest], y=[0, largest], mode="lines", line={"color": AXIS, "width": 1.5, "dash": "dash"},
            name="prediction and observation agree", hoverinfo="skip",
        )
    )  # fmt: skip
    figure.add_trace(
        go.Scatter(
            x=single(expected), y=single(observed), mode="markers",
            marker={"color": ELASTIC, "size": 6, "line": {"width": 0}},
            name="verification poses, sorted", hovertemplate="predicted %{x:.3f} mm<br>observed %{y:.3f} mm<extra></extra>",
        )
    )  # fmt: skip
    figure.update_xaxes(title_text="predicted error / mm", range=[0, largest], rangemode="tozero")
    figure.update_yaxes(title_text="observed error / mm", range=[0, largest], rangemode="tozero")
    figure.update_layout(font={"color": INK})
    return figure


def expected_quantiles(std: np.ndarray) -> np.ndarray:
    """Quantiles (N,) of the distance that errors of 1σ `std` (N,), alike in all directions, should show over all poses together."""
    from scipy.special import gammainc

    if not len(std) or not (std > 0).any():
        return np.zeros(len(std))
    floor = 1e-3 * std.max()
    grid = np.linspace(0, 4 * std.max(), 2000)
    below = gammainc(1.5, 1.5 * (grid[:, None] / np.maximum(std, floor)) ** 2).mean(axis=1)
    return np.interp((np.arange(len(std)) + 0.5) / len(std), below, grid)
