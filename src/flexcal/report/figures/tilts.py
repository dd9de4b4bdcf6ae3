"""Residuals of inclinometers in measuring order and against joint positions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.calibration.verification import MILLIRADIAN, MeasuredTilts
from flexcal.report.layout import ELASTIC, INK, NOMINAL, RIGID, Figure, as_float32, panels, trace
from flexcal.units import DEGREE, MILLIMETRE

_COLUMNS = 3
_COLOURS = (ELASTIC, RIGID, INK)


def tilt_order(tilts: MeasuredTilts) -> Figure:
    """Measured minus predicted readings (mrad) in measuring order, one panel an inclinometer, before and as calibrated."""
    sensors = tilts.sensors
    figure = panels(
        len(sensors),
        2,
        240 * len(sensors) + 70,
        [f"{s}, {m}" for s in sensors for m in ("before", "calibrated")],
    )
    for row, sensor in enumerate(sensors, 1):
        own = tilts.sensor == sensor
        for column, errors in enumerate((tilts.before, tilts.calibrated), 1):
            _axes(figure, np.arange(1.0, own.sum() + 1), errors[own], row, column, legend=row == column == 1)
            figure.update_xaxes(title_text="measurement, in order", nticks=5, row=row, col=column)
        figure.update_yaxes(title_text="residual / mrad", row=row, col=1)
    return figure


def tilt_joints(joints: Mapping[str, str], tilts: MeasuredTilts) -> Figure:
    """Measured minus predicted readings (mrad) of the calibrated robot against each joint (degrees, or mm where prismatic)."""
    rows = -(-len(joints) // _COLUMNS)
    figure = panels(rows, _COLUMNS, 230 * rows + 70, list(joints), row_gap=0.3 / rows)
    for i, kind in enumerate(joints.values()):
        row, column = i // _COLUMNS + 1, i % _COLUMNS + 1
        revolute = kind == "revolute"
        _axes(
            figure,
            tilts.q[:, i] / (DEGREE if revolute else MILLIMETRE),
            tilts.calibrated,
            row,
            column,
            legend=i == 0,
        )
        figure.update_xaxes(title_text="degrees" if revolute else "mm", nticks=5, row=row, col=column)
        figure.update_yaxes(
            matches="y" if i else None, showticklabels=column == 1, nticks=5, row=row, col=column
        )
    figure.update_yaxes(title_text="residual / mrad", row=(rows + 1) // 2, col=1)
    return figure


def _axes(figure: Figure, x: np.ndarray, errors: np.ndarray, row: int, column: int, *, legend: bool) -> None:
    """Markers of every axis that was read."""
    figure.update_yaxes(zeroline=True, zerolinecolor=NOMINAL, row=row, col=column)
    for k, axis in enumerate("xyz"):
        read = np.isfinite(errors[:, k])
        if read.any():
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32(x[read]), y=as_float32(errors[read, k] / MILLIRADIAN), mode="markers", name=f"axis {axis}",
                    legendgroup=axis, showlegend=legend, marker={"color": _COLOURS[k], "size": 4, "opacity": 0.7},
                    hovertemplate="%{x:.1f}: %{y:+.3f} mrad",
                ), row=row, col=column,
            )  # fmt: skip
