"""A plan of calibration poses: joint positions, poses in space, predicted error against their number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.model.robot import RobotModel
from flexcal.report.figures.robot_arm import polyline, space_axes
from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    INK,
    NOMINAL,
    QUIET,
    RIGID,
    Figure,
    Trace,
    as_float32,
    canvas,
    millimetre_axis,
    positive,
    trace,
)
from flexcal.units import DEGREE, MILLIMETRE


def joint_positions(model: RobotModel, q: np.ndarray) -> Figure:
    """One row a joint of the positions `q` (N, n), from its lower limit at the left to the upper at the right."""
    figure = canvas(90 + 44 * model.n, legend=False)
    for i, joint in enumerate(model.motor_joints):
        unit, name = (MILLIMETRE, "mm") if joint.kind == "prismatic" else (DEGREE, "°")
        ends = [joint.lower, joint.upper]
        if not np.isfinite(ends).all():
            ends = [min(-np.pi, float(q[:, i].min())), max(np.pi, float(q[:, i].max()))]
        share = (q[:, i] - ends[0]) / (ends[1] - ends[0])
        figure.add_trace(
            trace(
                "scatter",
                x=[0, 1], y=[joint.name] * 2, mode="lines+text", cliponaxis=False, line={"color": AXIS, "width": 2},
                text=[f"{end / unit:.0f} {name}".replace("-", "−") for end in ends], textposition=["middle left", "middle right"],
                hoverinfo="skip",
            )
        )  # fmt: skip
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(share), y=[joint.name] * len(q), mode="markers",
                marker={"color": ELASTIC, "size": 14, "symbol": "line-ns-open", "line": {"width": 1.5, "color": ELASTIC}},
                text=[f"pose {k}: {value / unit:.1f} {name}" for k, value in enumerate(q[:, i], 1)],
                hovertemplate="%{text}<extra></extra>",
            )
        )  # fmt: skip
    figure.update_xaxes(
        range=[-0.1, 1.1], showticklabels=False, ticks="", showgrid=False, title_text="between the limits"
    )
    figure.update_yaxes(autorange="reversed", showgrid=False)
    return figure


_COLOURS = (ELASTIC, NOMINAL, QUIET)
_NUMBERS = [m * 10**e for e in range(5) for m in (1, 2, 5)]


def pose_numbers(
    numbers: Sequence[int], errors: Mapping[str, Sequence[float]], plan: int, desired_error: float | None
) -> Figure:
    """Named `errors` (mm) against the `numbers` of poses, both logarithmic, with the number of the `plan` and the `desired_error`."""
    figure = canvas(400)
    for colour, (name, values) in zip(_COLOURS, errors.items(), strict=False):
        figure.add_trace(
            trace(
                "scatter",
                x=as_float32(numbers), y=positive(np.asarray(values)), mode="lines+markers", name=name,
                line={"color": colour, "width": 2}, marker={"size": 5, "color": colour},
                hovertemplate="%{x} poses: %{y:.4f} mm",
            )
        )  # fmt: skip
    figure.add_vline(x=plan, line={"color": AXIS, "width": 1.5, "dash": "dash"})
    if desired_error is not None:
        figure.add_hline(y=desired_error, line={"color": RIGID, "width": 1.5, "dash": "dot"})
    figure.update_xaxes(type="log", title_text="poses", tickvals=_NUMBERS)
    millimetre_axis(figure, title="predicted tool error / mm")
    return figure


_EDGES = np.array(
    [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 6], [5, 7], [6, 7]]
)


def plan_space(
    corners: np.ndarray,
    links: Trace,
    working: np.ndarray | None,
    box: np.ndarray | None,
    station: np.ndarray | None,
) -> Figure:
    """Skeletons `corners` (N, K, 3), the `links` in one pose, the target's path, `working` points (W, 3), their `box` (2, 3), the
    instrument (3,); all in m."""
    figure = canvas(620)
    tips = corners[:, -1]
    figure.add_trace(links)
    figure.add_trace(polyline(corners, "arm at other poses", NOMINAL, 2.5, opacity=0.45))
    figure.add_trace(polyline(tips[None], "order", ELASTIC, 3.0, opacity=0.6))
    labels = [f"pose {k}" for k in range(1, len(tips) + 1)]
    figure.add_trace(_points(tips, "target", ELASTIC, 4, labels))
    if working is not None:
        figure.add_trace(_points(working, "where it will work", QUIET, 1.5, [""] * len(working)))
    if box is not None:
        ends = box[(np.arange(8)[:, None] >> np.arange(3)) & 1, np.arange(3)]
        figure.add_trace(polyline(ends[_EDGES], "working volume", INK, 4.0))
    if station is not None:
        figure.add_trace(_points(station[None], "instrument", RIGID, 7, ["instrument"]))
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure


def _points(places: np.ndarray, name: str, colour: str, size: float, labels: list[str]) -> Trace:
    return trace(
        "scatter3d",
        x=as_float32(places[:, 0]), y=as_float32(places[:, 1]), z=as_float32(places[:, 2]), mode="markers", name=name,
        marker={"size": size, "color": colour}, text=labels, hovertemplate="%{text}<extra></extra>",
        hoverinfo=None if labels[0] else "skip",
    )  # fmt: skip
