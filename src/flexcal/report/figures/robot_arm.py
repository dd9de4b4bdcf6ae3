"""The arm at its measured points, in three dimensions, with the errors drawn as exaggerated arrows (Fig. 10 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexcal.calibration.verification import CALIBRATED, ArmPoses
from flexcal.model.kinematics import LinkSurface
from flexcal.model.robot import RobotModel
from flexcal.report.layout import (
    ELASTIC,
    GRID,
    LINKS,
    NOMINAL,
    QUIET,
    RIGID,
    Figure,
    Trace,
    as_float32,
    canvas,
    trace,
)
from flexcal.units import MILLIMETRE

_FAINT = 0.25
"""Opacity of the links in all poses but the first."""

_HEAD = 0.35
"""Length of an arrow's head relative to that of the arrow."""


def arm_poses(arms: ArmPoses, labels: Mapping[str, str], factors: Mapping[str, float]) -> Figure:
    """The links in a few poses, the arm as lines in others, and at each measured point an error vector.

    `labels` are the words for the models of `arms.errors`, `factors` how many times longer than they are their arrows are drawn. The
    traces of a model carry `meta = {"arrows": label, "exaggeration": factor}`, by which the page chooses and stretches them. Everything is
    drawn in the robot's base frame.
    """
    figure = canvas(620)
    figure.add_trace(polyline(arms.corners, "arm at other poses", NOMINAL, 2.5, opacity=0.45))
    for number, vertices in enumerate(arms.surface):
        figure.add_trace(
            link_mesh(vertices, arms.triangles, 1.0 if number == 0 else _FAINT, legend=number == 0)
        )
    tips = arms.tip
    figure.add_trace(
        trace(
            "scatter3d",
            x=as_float32(tips[:, 0]), y=as_float32(tips[:, 1]), z=as_float32(tips[:, 2]),
            mode="markers", marker={"size": 2.5, "color": NOMINAL}, name="measured point",
            text=[f"pose {k}" for k in arms.pose], hovertemplate="%{text}<extra></extra>",
        )
    )  # fmt: skip
    for number, (model, label) in enumerate(labels.items()):
        vectors, factor = arms.errors[model], factors[model]
        colour = ELASTIC if model == CALIBRATED else RIGID
        sizes = np.linalg.norm(vectors, axis=1) / MILLIMETRE
        texts = [f"pose {k}: {size:.3f} mm" for k, size in zip(arms.pose, sizes, strict=True)]
        for part in arrows(tips, factor * vectors, "error", colour, texts):
            figure.add_trace(
                part | {"meta": {"arrows": label, "exaggeration": factor}, "visible": number == 0}
            )
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure


def arrows(
    tips: np.ndarray, vectors: np.ndarray, name: str, colour: str, texts: Sequence[str]
) -> tuple[Trace, Trace]:
    """Arrows `vectors` (N, 3) from `tips` (N, 3), m, as lines and heads with a text each."""
    ends = tips + vectors
    heads = trace(
        "cone",
        x=as_float32(ends[:, 0]), y=as_float32(ends[:, 1]), z=as_float32(ends[:, 2]),
        u=as_float32(vectors[:, 0]), v=as_float32(vectors[:, 1]), w=as_float32(vectors[:, 2]),
        anchor="tip", sizemode="raw", sizeref=_HEAD, showscale=False, colorscale=[[0, colour], [1, colour]],
        lighting={"ambient": 0.9, "diffuse": 0.3}, text=list(texts), hovertemplate="%{text}<extra></extra>",
    )  # fmt: skip
    return polyline(np.stack([tips, ends], axis=1), name, colour, 5.0), heads


def space_axes() -> dict[str, Any]:
    """Axes of a scene in metres, all to one scale."""
    axis = {
        "backgroundcolor": "rgba(0,0,0,0)",
        "gridcolor": GRID,
        "zerolinecolor": GRID,
        "color": QUIET,
        "showspikes": False,
        "nticks": 5,
    }
    return {
        "aspectmode": "data",
        "xaxis": axis | {"title": {"text": "x / m"}},
        "yaxis": axis | {"title": {"text": "y / m"}},
        "zaxis": axis | {"title": {"text": "z / m"}},
        "camera": {"eye": {"x": 1.2, "y": 1.2, "z": 0.55}, "center": {"x": 0, "y": 0, "z": -0.12}},
    }


def polyline(corners: np.ndarray, name: str, colour: str, width: float, opacity: float = 1.0) -> Trace:
    """Several lines (lines, corners, 3) as one trace, parted by gaps."""
    parted = np.concatenate([corners, np.full((len(corners), 1, 3), np.nan)], axis=1).reshape(-1, 3)
    return trace(
        "scatter3d",
        x=as_float32(parted[:, 0]),
        y=as_float32(parted[:, 1]),
        z=as_float32(parted[:, 2]),
        mode="lines",
        name=name,
        line={"color": colour, "width": width},
        opacity=opacity,
        hoverinfo="skip",
    )


def link_mesh(vertices: np.ndarray, triangles: np.ndarray, opacity: float, *, legend: bool) -> Trace:
    """The links of the arm (V, 3), (F, 3) as one shaded trace."""
    numbers = triangles.astype(np.int32)
    return trace(
        "mesh3d",
        x=as_float32(vertices[:, 0]), y=as_float32(vertices[:, 1]), z=as_float32(vertices[:, 2]),
        i=numbers[:, 0], j=numbers[:, 1], k=numbers[:, 2],
        color=LINKS, opacity=opacity, flatshading=True, name="links", showlegend=legend, hoverinfo="skip",
        lightposition={"x": 1000, "y": 2000, "z": 4000},
        lighting={"ambient": 0.8, "diffuse": 0.35, "specular": 0.05},
    )  # fmt: skip


def links_at(model: RobotModel, q: np.ndarray) -> list[Trace]:
    """The links of a robot at joint positions `q` (P, n), one shaded trace a pose."""
    surface = LinkSurface.of(model)
    return [link_mesh(vertices, surface.triangles, 1.0, legend=True) for vertices in surface.at(model, q)]
