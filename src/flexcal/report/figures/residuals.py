"""Residuals against joint positions, gravity torques, measuring order and place."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.calibration.diagnostics import GravityLoads
from flexcal.calibration.verification import CALIBRATED, RIGID
from flexcal.data.poses import PoseSet
from flexcal.report.figures.robot_arm import space_axes
from flexcal.report.layout import AXIS, ELASTIC, GRID, INK, NOMINAL, Figure, as_float32, canvas, panels, trace
from flexcal.report.layout import RIGID as RIGID_COLOUR
from flexcal.units import DEGREE, MILLIMETRE

_BINS = 12
_COLUMNS = 3


def residual_joints(joints: Mapping[str, str], poses: PoseSet, residuals: np.ndarray) -> Figure:
    """Distance (mm) of residuals (N, 3) m against each joint (degrees, or mm where prismatic), and its mean in twelve bins.

    `joints` are kinds (revolute, prismatic) by name.
    """
    rows = -(-len(joints) // _COLUMNS)
    figure = panels(rows, _COLUMNS, 230 * rows + 70, list(joints), row_gap=0.3 / rows)
    distance = np.linalg.norm(residuals, axis=1) / MILLIMETRE
    for i, kind in enumerate(joints.values()):
        row, column = i // _COLUMNS + 1, i % _COLUMNS + 1
        revolute = kind == "revolute"
        q = poses.q[:, i] / (DEGREE if revolute else MILLIMETRE)
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(q), y=as_float32(distance), mode="markers", name="error", legendgroup="a", showlegend=i == 0,
                marker={"color": ELASTIC, "size": 3.5, "opacity": 0.45},
                hovertemplate="%{x:.1f}: %{y:.3f} mm",
            ), row=row, col=column,
        )  # fmt: skip
        centres, means = _binned(q, distance)
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(centres), y=as_float32(means), mode="lines+markers", name="mean", legendgroup="b", showlegend=i == 0,
                line={"color": INK, "width": 1.6}, marker={"size": 4}, hoverinfo="skip",
            ), row=row, col=column,
        )  # fmt: skip
        figure.update_xaxes(title_text="degrees" if revolute else "mm", nticks=5, row=row, col=column)
        figure.update_yaxes(matches="y" if i else None, showticklabels=column == 1, row=row, col=column)
    figure.update_yaxes(rangemode="tozero", nticks=5)
    figure.update_yaxes(title_text="error / mm", row=(rows + 1) // 2, col=1)
    return figure


def _binned(q: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    edges = np.linspace(q.min(), q.max() + 1e-9, _BINS + 1)
    number = np.clip(np.digitize(q, edges) - 1, 0, _BINS - 1)
    filled = [k for k in range(_BINS) if (number == k).any()]
    centres = 0.5 * (edges[:-1] + edges[1:])[filled]
    return centres, np.array([values[number == k].mean() for k in filled])


_TORQUE_COLUMNS = 3
_LOADED = 0.01
_LOOK = {RIGID: ("rigid geometry alone", NOMINAL), CALIBRATED: ("calibrated", ELASTIC)}


def loaded_joints(joints: Mapping[str, str], loads: GravityLoads) -> list[int]:
    """Revolute joints whose gravity torque varies by more than 1 % of that of the most loaded one."""
    spread = np.ptp(loads.torque, axis=0)
    clear = max(_LOADED * float(spread.max(initial=0.0)), 1e-6)
    return [i for i, kind in enumerate(joints.values()) if kind == "revolute" and spread[i] > clear]


def residual_torque(joints: Mapping[str, str], loads: GravityLoads) -> Figure:
    """Residual (mm) along the motion of the point by each loaded joint against its gravity torque (N m), with fitted lines by model."""
    chosen, names = loaded_joints(joints, loads), list(joints)
    count = -(-len(chosen) // _TORQUE_COLUMNS)
    figure = panels(
        count,
        _TORQUE_COLUMNS,
        230 * count + 70,
        [names[i] for i in chosen],
        row_gap=0.3 / max(count, 1),
    )
    for k, i in enumerate(chosen):
        row, column = k // _TORQUE_COLUMNS + 1, k % _TORQUE_COLUMNS + 1
        torque = loads.torque[:, i]
        for model, (label, colour) in _LOOK.items():
            if model not in loads.along:
                continue
            along = loads.along[model][:, i] / MILLIMETRE
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32(torque), y=as_float32(along), mode="markers", name=label, legendgroup=model, showlegend=k == 0,
                    marker={"color": colour, "size": 3.5, "opacity": 0.5}, hovertemplate="%{x:.2f} N m: %{y:+.3f} mm",
                ), row=row, col=column,
            )  # fmt: skip
            slope, start = np.polyfit(torque - torque.mean(), along, 1)
            ends = np.array([torque.min(), torque.max()])
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32(ends), y=as_float32(start + slope * (ends - torque.mean())), mode="lines", legendgroup=model,
                    showlegend=False, line={"color": colour, "width": 2}, hoverinfo="skip",
                ), row=row, col=column,
            )  # fmt: skip
        figure.update_xaxes(title_text="gravity torque / N m", nticks=5, row=row, col=column)
        figure.update_yaxes(
            matches="y" if k else None, showticklabels=column == 1, nticks=5, row=row, col=column
        )
    figure.update_yaxes(title_text="residual / mm", row=(count + 1) // 2, col=1)
    return figure


_WINDOW = 25


def residual_trend(
    values: np.ndarray, residuals: np.ndarray, title: str, label: str = "measured minus predicted"
) -> Figure:
    """Components x, y, z (mm) of residuals (N, 3) m, what the `label` says, against `values` (N,), with a running mean of 25 neighbours."""
    figure = panels(3, 1, 500, ["x", "y", "z"], row_gap=0.08)
    order = np.argsort(values, kind="stable")
    values, residuals = values[order], residuals[order]
    largest = 1.08 * float(np.abs(residuals).max(initial=1e-9)) / MILLIMETRE
    window = min(_WINDOW, max(1, len(residuals) // 4))
    kernel = np.full(window, 1 / window)
    for k in range(3):
        components = residuals[:, k] / MILLIMETRE
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(values), y=as_float32(components), mode="markers", name=label,
                marker={"color": ELASTIC, "size": 4, "opacity": 0.6}, legendgroup="a", showlegend=k == 0,
                hovertemplate="%{x}: %{y:+.3f} mm",
            ), row=k + 1, col=1,
        )  # fmt: skip
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(np.convolve(values, kernel, mode="valid")), y=as_float32(np.convolve(components, kernel, mode="valid")),
                mode="lines", name=f"mean of {window} neighbours",
                line={"color": INK, "width": 1.6}, legendgroup="b", showlegend=k == 0, hoverinfo="skip",
            ), row=k + 1, col=1,
        )  # fmt: skip
        figure.update_xaxes(showticklabels=k == 2, row=k + 1, col=1)
    figure.update_yaxes(range=[-largest, largest], nticks=5)
    figure.update_yaxes(title_text="error / mm", row=2, col=1)
    figure.update_xaxes(title_text=title, row=3, col=1)
    return figure


def residual_workspace(pose: np.ndarray, position: np.ndarray, residuals: np.ndarray) -> Figure:
    """Points (N, 3) m of poses with numbers (N,), coloured by the distance (mm) of residuals (N, 3) m."""
    figure = canvas(560, legend=False)
    distance = np.linalg.norm(residuals, axis=1) / MILLIMETRE
    figure.add_trace(
        trace(
            "scatter3d",
            x=as_float32(position[:, 0]),
            y=as_float32(position[:, 1]),
            z=as_float32(position[:, 2]),
            mode="markers",
            marker={
                "size": 5 if len(pose) <= 300 else 3.5,
                "color": as_float32(distance),
                "cmin": 0,
                "cmax": float(np.quantile(distance, 0.99)) if len(distance) else 1.0,
                "colorscale": [[0, GRID], [0.5, ELASTIC], [1, RIGID_COLOUR]],
                "line": {"width": 0.5, "color": AXIS},
                "colorbar": {"title": {"text": "error / mm", "side": "top"}, "thickness": 12, "len": 0.6, "x": 1, "xanchor": "right"},
            },
            text=[f"pose {k}: {d:.3f} mm" for k, d in zip(pose, distance, strict=True)],
            hovertemplate="%{text}<extra></extra>",
        )
    )  # fmt: skip
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 10, "b": 0})
    return figure


_FIELD_BINS = 10
_SHOWN = 0.998
"""Quantile of the sizes spanned by the axis, so that outliers do not compress the rest."""


def error_field(position: np.ndarray, residuals: np.ndarray) -> Figure:
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
                trace(
                    "scatter",
                    x=as_float32(position[:, axis]), y=as_float32(error), mode="markers", name="error", legendgroup="error",
                    showlegend=first, marker={"color": ELASTIC, "size": 3.5, "opacity": 0.4},
                    hovertemplate=f"{along} %{{x:.3f}} m: %{{y:+.3f}} mm in {name}",
                ), row=row, col=column,
            )  # fmt: skip
            centres, means = _means(position[:, axis], error)
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32(centres), y=as_float32(means), mode="lines+markers", name="mean", legendgroup="mean",
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
    parts = np.array_split(np.argsort(values, kind="stable"), min(_FIELD_BINS, max(1, len(values) // 5)))
    return np.array([values[p].mean() for p in parts]), np.array([errors[p].mean() for p in parts])
