"""Fig. 10: the arm in its calibration poses, in three dimensions, with the errors drawn as exaggerated arrows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from flexcal.data import PoseSet
from flexcal.model import RobotModel
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, GRID, INK, NOMINAL, QUIET, RIGID

_EXAMPLES = 3
"""Poses drawn boldly, as in the paper's figure."""


def arm_poses(
    model: RobotModel, poses: PoseSet, arrows: Mapping[str, tuple[np.ndarray, float, bool]]
) -> go.Figure:
    """Skeletons of the arm, and at each measured point an error vector.

    `arrows` maps a label to (vectors (N, 3) m, exaggeration, calibrated); traces of each carry `meta = {"arrows": label}`, by which the
    page chooses. Everything is drawn in the robot's base frame.
    """
    corners = skeletons(model, poses)
    figure = canvas(620)
    figure.add_trace(polyline(corners, "all poses", NOMINAL, 2.5, opacity=0.45))
    chosen = corners[:: max(1, len(corners) // _EXAMPLES)][:_EXAMPLES]
    examples = polyline(chosen, f"{len(chosen)} of the poses", INK, 9.0)
    examples.update(mode="lines+markers", marker={"size": 4, "color": INK})
    figure.add_trace(examples)
    tips = corners[:, -1]
    figure.add_trace(
        go.Scatter3d(
            x=single(tips[:, 0]), y=single(tips[:, 1]), z=single(tips[:, 2]),
            mode="markers", marker={"size": 3, "color": NOMINAL}, name="measured point",
            text=[f"pose {k}" for k in poses.pose], hovertemplate="%{text}<extra></extra>",
        )
    )  # fmt: skip
    for number, (label, (vectors, factor, calibrated)) in enumerate(arrows.items()):
        colour = ELASTIC if calibrated else RIGID
        ends = tips + factor * vectors
        shown = number == 0
        shafts = polyline(np.stack([tips, ends], axis=1), "error", colour, 6.0)
        shafts.update(meta={"arrows": label}, visible=shown)
        sizes = np.linalg.norm(vectors, axis=1) * 1e3
        heads = go.Scatter3d(
            x=single(ends[:, 0]), y=single(ends[:, 1]), z=single(ends[:, 2]),
            mode="markers", marker={"size": 4, "color": colour}, showlegend=False, meta={"arrows": label}, visible=shown,
            text=[f"pose {k}: {size:.3f} mm" for k, size in zip(poses.pose, sizes, strict=True)],
            hovertemplate="%{text}<extra></extra>",
        )  # fmt: skip
        figure.add_traces([shafts, heads])
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure


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


def skeletons(model: RobotModel, poses: PoseSet) -> np.ndarray:
    """Corners (N, joints + 2, 3) m of the arm from the base through every joint to the measured point, base frame, undeflected."""
    chain: list[int] = []
    joint = model.point(str(poses.target[0])).joint
    while joint >= 0:
        chain.insert(0, joint)
        joint = model.joints[joint].parent
    still = np.zeros((len(poses), model.n, 3))
    q = np.ascontiguousarray(poses.q)
    target = model.point(str(poses.target[0]))

    def place(index: int, rotation: np.ndarray, translation: np.ndarray, xyz: np.ndarray) -> np.ndarray:
        frame = np.ascontiguousarray(rotation), np.ascontiguousarray(translation)
        geometry = np.ascontiguousarray(model.geometry)
        return model.tree.point(index, frame[0], frame[1], xyz, geometry, np.zeros(6), q, still, False)[0]

    origins = [place(k, np.eye(3), np.zeros(3), np.zeros(3)) for k in chain]
    tip = place(target.joint, target.rotation, target.translation, target.xyz)
    return np.stack([np.zeros_like(tip), *origins, tip], axis=1)


def polyline(corners: np.ndarray, name: str, colour: str, width: float, opacity: float = 1.0) -> go.Scatter3d:
    """Several lines (lines, corners, 3) as one trace, parted by gaps."""
    parted = np.concatenate([corners, np.full((len(corners), 1, 3), np.nan)], axis=1).reshape(-1, 3)
    return go.Scatter3d(
        x=single(parted[:, 0]),
        y=single(parted[:, 1]),
        z=single(parted[:, 2]),
        mode="lines",
        name=name,
        line={"color": colour, "width": width},
        opacity=opacity,
        hoverinfo="skip",
    )
