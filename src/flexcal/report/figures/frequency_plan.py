"""A plan of frequency experiments: arm, amplitudes, and predicted standard deviations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.model.kinematics import joint_origins
from flexcal.model.robot import RobotModel
from flexcal.report.figures.robot_arm import links_at, space_axes
from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    NOMINAL,
    Figure,
    as_float32,
    canvas,
    panels,
    spring_label,
    trace,
)


def predicted_springs(planned: Mapping[str, float], flat: Mapping[str, float]) -> Figure:
    """Predicted standard deviation (per cent, logarithmic) of every stiffness and damping, beside that with a flat spectrum."""
    stiffness = [name for name in planned if name.endswith(".stiffness")]
    figure = panels(1, 2, 90 + 34 * len(stiffness), ["stiffness", "damping"])
    for column, names in enumerate((stiffness, [n for n in planned if n not in stiffness]), start=1):
        for name, std, colour in (("flat", flat, NOMINAL), ("planned", planned, ELASTIC)):
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32([100 * std[n] for n in names]),
                    y=[spring_label(n) for n in names],
                    name=name,
                    legendgroup=name,
                    showlegend=column == 1,
                    mode="markers",
                    marker={"color": colour, "size": 9},
                    hovertemplate="%{y}: %{x:.2f} %",
                ),
                row=1,
                col=column,
            )
    ticks = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100]
    figure.update_xaxes(
        type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks], title_text="standard deviation / %"
    )
    figure.update_yaxes(autorange="reversed")
    figure.update_yaxes(showticklabels=False, col=2)
    return figure


def poses_against_std(curve: np.ndarray, planned: int) -> Figure:
    """Largest predicted standard deviation of a stiffness (per cent) against the number of poses; `curve` (3, K): poses, chosen, random."""
    counts, chosen, random = curve
    figure = canvas(320)
    for name, values, colour in (("at random", random, NOMINAL), ("chosen one by one", chosen, ELASTIC)):
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(counts),
                y=as_float32(100 * values),
                name=name,
                mode="lines+markers",
                line={"color": colour, "width": 2},
                hovertemplate="%{x} poses: %{y:.2f} %",
            )
        )
    figure.add_vline(x=planned, line={"color": AXIS, "width": 1.5, "dash": "dot"})
    ticks = [0.5, 1, 2, 5, 10, 20, 50, 100]
    figure.update_yaxes(type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks])
    figure.update_yaxes(title_text="largest standard deviation of a stiffness / %")
    figure.update_xaxes(title_text="poses", dtick=1)
    return figure


def amplitude_spectrum(plan: MultisinePlan, flat: MultisinePlan) -> Figure:
    """Torque (N m) of every line of each excited axis, one panel an axis."""
    axes = len(plan.joints)
    figure = panels(axes, 1, 60 + 150 * axes, [f"axis {joint + 1}" for joint in plan.joints], row_gap=0.09)
    for k in range(axes):
        for name, source, colour, width in (("flat", flat, NOMINAL, 1.6), ("planned", plan, ELASTIC, 2.0)):
            figure.add_trace(
                trace(
                    "scatter",
                    x=as_float32(source.frequencies_hz),
                    y=as_float32(source.amplitude[k]),
                    name=name,
                    legendgroup=name,
                    showlegend=k == 0,
                    mode="lines",
                    line={"color": colour, "width": width, "shape": "hvh"},
                    hovertemplate="%{x:.2f} Hz: %{y:.2f} N m",
                ),
                row=k + 1,
                col=1,
            )
    figure.update_yaxes(rangemode="tozero")
    figure.update_yaxes(title_text="amplitude of a line / N m", row=(axes + 1) // 2, col=1)
    figure.update_xaxes(title_text="Hz", row=axes, col=1)
    return figure


def planned_arm(model: RobotModel, q: np.ndarray) -> Figure:
    """The links in the first pose, and lines from the base through every joint to the measured point at each of `q` (P, n) rad."""
    figure, arms = canvas(520), joint_origins(model, q)
    figure.add_trace(links_at(model, q[:1])[0])
    for number, corners in enumerate(arms, start=1):
        figure.add_trace(
            trace(
                "scatter3d",
                x=as_float32(corners[:, 0]),
                y=as_float32(corners[:, 1]),
                z=as_float32(corners[:, 2]),
                mode="lines+markers",
                name=f"pose {number}",
                line={"width": 6, "color": ELASTIC},
                marker={"size": 3, "color": ELASTIC},
                opacity=0.35 + 0.65 * number / len(q),
            )
        )
    figure.update_layout(scene=_cube(arms), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure


def _cube(corners: np.ndarray) -> dict[str, Any]:
    """Axes of equal length about all `corners` (..., 3), m: arms that stand in one plane would else be drawn as large as it is thin."""
    scene: dict[str, Any] = {**space_axes(), "aspectmode": "cube"}
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    half = 0.55 * (high - low).max()
    for axis, middle in zip("xyz", (low + high) / 2, strict=True):
        scene[f"{axis}axis"] |= {"range": [middle - half, middle + half]}
    return scene
