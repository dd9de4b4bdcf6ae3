"""The paths of a point through space on planned motions, with the arm at some instants."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.arm_poses import space_axes
from flexcal.report.figures.canvas import canvas, single
from flexcal.report.palette import ELASTIC, NOMINAL

_ARMS = 6


def swept_paths(chains: Mapping[str, np.ndarray], links: Mapping[str, go.Mesh3d]) -> go.Figure:
    """Of each motion the path of the arm's last corner, from corners (N, corners, 3), m, and the `links` at its beginning, one motion
    shown at a time.

    Traces carry `meta = {"trajectory": label}`, by which the page chooses.
    """
    figure = canvas(560)
    for number, (label, corners) in enumerate(chains.items()):
        shown = {"meta": {"trajectory": label}, "visible": number == 0, "hoverinfo": "skip"}
        path = np.concatenate([corners[:, -1], corners[:1, -1]])
        arms = corners[:: max(1, len(corners) // _ARMS)]
        parted = np.concatenate([arms, np.full((len(arms), 1, 3), np.nan)], axis=1).reshape(-1, 3)
        figure.add_trace(links[label].update(meta=shown["meta"], visible=shown["visible"]))
        for points, name, colour, width in (
            (parted, "the arm on its path", NOMINAL, 3.0),
            (path, "path of the point", ELASTIC, 4.0),
        ):
            x, y, z = (single(points[:, axis]) for axis in range(3))
            line = {"color": colour, "width": width}
            figure.add_trace(go.Scatter3d(x=x, y=y, z=z, mode="lines", name=name, line=line, **shown))
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure
