"""Residuals against the gravity torque on every joint: a slope is a compliance that the model lacks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.gravity_loads import GravityLoads
from flexcal.report.measured_points import CALIBRATED, RIGID
from flexcal.report.palette import ELASTIC, NOMINAL
from flexcal.units import MILLIMETRE

_COLUMNS = 3
_LOADED = 0.01
_LOOK = {RIGID: ("rigid geometry alone", NOMINAL), CALIBRATED: ("calibrated", ELASTIC)}


def loaded_joints(joints: Mapping[str, str], loads: GravityLoads) -> list[int]:
    """Revolute joints whose gravity torque varies by more than 1 % of that of the most loaded one."""
    spread = np.ptp(loads.torque, axis=0)
    clear = max(_LOADED * float(spread.max(initial=0.0)), 1e-6)
    return [i for i, kind in enumerate(joints.values()) if kind == "revolute" and spread[i] > clear]


def residual_torque(joints: Mapping[str, str], loads: GravityLoads) -> go.Figure:
    """Residual (mm) along the motion of the point by each loaded joint against its gravity torque (N m), with fitted lines by model."""
    chosen, names = loaded_joints(joints, loads), list(joints)
    count = -(-len(chosen) // _COLUMNS)
    figure = panels(
        count, _COLUMNS, 230 * count + 70, [names[i] for i in chosen], row_gap=0.3 / max(count, 1)
    )
    for k, i in enumerate(chosen):
        row, column = k // _COLUMNS + 1, k % _COLUMNS + 1
        torque = loads.torque[:, i]
        for model, (label, colour) in _LOOK.items():
            if model not in loads.along:
                continue
            along = loads.along[model][:, i] / MILLIMETRE
            figure.add_trace(
                go.Scatter(
                    x=single(torque), y=single(along), mode="markers", name=label, legendgroup=model, showlegend=k == 0,
                    marker={"color": colour, "size": 3.5, "opacity": 0.5}, hovertemplate="%{x:.2f} N m: %{y:+.3f} mm",
                ), row=row, col=column,
            )  # fmt: skip
            slope, start = np.polyfit(torque - torque.mean(), along, 1)
            ends = np.array([torque.min(), torque.max()])
            figure.add_trace(
                go.Scatter(
                    x=single(ends), y=single(start + slope * (ends - torque.mean())), mode="lines", legendgroup=model,
                    showlegend=False, line={"color": colour, "width": 2}, hoverinfo="skip",
                ), row=row, col=column,
            )  # fmt: skip
        figure.update_xaxes(title_text="gravity torque / N m", nticks=5, row=row, col=column)
        figure.update_yaxes(
            matches="y" if k else None, showticklabels=column == 1, nticks=5, row=row, col=column
        )
    figure.update_yaxes(title_text="residual / mm", row=(count + 1) // 2, col=1)
    return figure
