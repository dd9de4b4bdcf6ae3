"""Histograms, cumulative distributions and quantiles of errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.calibration.verification import CALIBRATED, NOMINAL, PredictionErrors
from flexcal.report.figures.pose_errors import ErrorSeries
from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    GRID,
    INK,
    QUIET,
    Figure,
    as_float32,
    canvas,
    millimetre_axis,
    positive,
    trace,
)
from flexcal.report.layout import NOMINAL as GREY
from flexcal.units import MILLIMETRE


def error_distribution(series: Sequence[ErrorSeries], published: Mapping[str, tuple[float, float]]) -> Figure:
    """Share of poses (percent) against error (mm, log scale); `published` holds points (error in m, share) by name."""
    figure = canvas(400)
    figure.add_hline(y=90, line={"color": GRID, "width": 2})
    for item in series:
        distance = np.sort(item.millimetres)
        share = 100 * np.arange(1, len(distance) + 1) / len(distance)
        figure.add_trace(
            trace(
                "scatter",
                x=positive(distance),
                y=as_float32(share),
                mode="lines",
                line={"color": item.colour, "width": 2.5, "shape": "hv"},
                name=item.name,
                hovertemplate="%{y:.0f} % of poses within %{x:.3f} mm",
            )
        )
    for name, (error, share) in published.items():
        figure.add_trace(
            trace(
                "scatter",
                x=[error * 1e3],
                y=[100 * share],
                mode="markers",
                marker={
                    "color": INK,
                    "size": 10,
                    "symbol": "star-diamond-open" if "rigid" in name else "diamond-open",
                },
                name=name,
                hovertemplate="%{fullData.name}: %{x:.2f} mm<extra></extra>",
            )
        )
    millimetre_axis(figure, "x")
    everything = np.concatenate([item.millimetres for item in series])
    everything = everything[everything > 0]
    if len(everything):
        low, high = float(np.quantile(everything, 0.002)), float(everything.max())
        figure.update_xaxes(range=[np.log10(low / 1.2), np.log10(high * 1.2)])
    figure.update_yaxes(title_text="share of poses", ticksuffix=" %", range=[0, 104])
    figure.add_annotation(
        x=0, xref="paper", y=90, text="90 %", showarrow=False, xanchor="left", yshift=8, font={"size": 11, "color": QUIET}
    )  # fmt: skip
    return figure


_PER_DECADE = 12
_LOOK = {NOMINAL: ("as delivered", GREY), CALIBRATED: ("calibrated", ELASTIC)}


def error_histogram(errors: Mapping[str, np.ndarray]) -> Figure:
    """Share of points (percent) by distance (mm), in bins of equal ratio; `errors` (N, 3) m by model, as delivered and calibrated."""
    figure = canvas(360)
    distances = {
        model: np.maximum(np.linalg.norm(errors[model], axis=1) / MILLIMETRE, 1e-6)
        for model in _LOOK
        if model in errors
    }
    everything = np.concatenate(list(distances.values()))
    low = np.floor(_PER_DECADE * np.log10(np.quantile(everything, 0.005)))
    high = np.ceil(_PER_DECADE * np.log10(everything.max()) + 1e-9)
    edges = 10.0 ** (np.arange(low, high + 1) / _PER_DECADE)
    for model, distance in distances.items():
        label, colour = _LOOK[model]
        count, _ = np.histogram(np.clip(distance, edges[0], edges[-1]), edges)
        share = 100 * count / len(distance)
        outline = np.repeat(edges, 2)[1:-1]
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(outline), y=as_float32(np.repeat(share, 2)), mode="lines", fill="tozeroy", name=label,
                line={"color": colour, "width": 1.5}, opacity=0.7,
                hovertemplate="%{x:.3f} mm: %{y:.1f} % of points",
            )
        )  # fmt: skip
        middle = float(np.median(distance))
        figure.add_vline(x=middle, line={"color": colour, "width": 1.5, "dash": "dot"})
        figure.add_annotation(
            x=np.log10(middle), y=1, yref="paper", text=f"median {middle:.3f}", showarrow=False, xanchor="left", xshift=4,
            font={"size": 11, "color": QUIET},
        )  # fmt: skip
    millimetre_axis(figure, "x")
    figure.update_xaxes(range=[np.log10(edges[0]), np.log10(edges[-1])])
    figure.update_yaxes(title_text="share of points", ticksuffix=" %", rangemode="tozero")
    return figure


def predicted_quantiles(verification: PredictionErrors) -> Figure:
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
        trace(
            "scatter",
            x=[0, largest], y=[0, largest], mode="lines", line={"color": AXIS, "width": 1.5, "dash": "dash"},
            name="prediction and observation agree", hoverinfo="skip",
        )
    )  # fmt: skip
    figure.add_trace(
        trace(
            "scatter",
            x=as_float32(expected), y=as_float32(observed), mode="markers",
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
