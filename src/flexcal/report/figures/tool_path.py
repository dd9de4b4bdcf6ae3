"""Tool points of a program in space, before and after its correction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.report.figures.robot_arm import arrows, polyline, space_axes
from flexcal.report.layout import ELASTIC, NOMINAL, RIGID, Figure, Trace, as_float32, canvas, trace
from flexcal.units import MILLIMETRE


def program_path(
    links: Trace,
    nominal: np.ndarray,
    corrected: np.ndarray,
    lines: Sequence[int],
    label: str,
    factor: float,
) -> Figure:
    """Paths `nominal` and `corrected` (N, 3), m, NaN where there is none, and arrows from one to the other, `factor` times longer.

    The `lines` of the program name the targets. The arrows carry `meta = {"arrows": label, "exaggeration": factor}`, by which the page
    chooses and stretches them.
    """
    figure = canvas(620)
    figure.add_trace(links)
    figure.add_trace(polyline(nominal[None], "as written", NOMINAL, 4.0))
    figure.add_trace(polyline(corrected[None], "corrected", ELASTIC, 4.0))
    known = np.flatnonzero(np.isfinite(corrected).all(axis=1) & np.isfinite(nominal).all(axis=1))
    at, shift = nominal[known], (corrected - nominal)[known]
    sizes = np.linalg.norm(shift, axis=1) / MILLIMETRE
    texts = [f"line {lines[k]}: {size:.3f} mm" for k, size in zip(known.tolist(), sizes, strict=True)]
    figure.add_trace(
        trace(
            "scatter3d",
            x=as_float32(at[:, 0]), y=as_float32(at[:, 1]), z=as_float32(at[:, 2]), mode="markers", name="target",
            marker={"size": 3, "color": NOMINAL}, text=texts, hovertemplate="%{text}<extra></extra>",
        )
    )  # fmt: skip
    for part in arrows(at, factor * shift, "shift", RIGID, texts):
        figure.add_trace(part | {"meta": {"arrows": label, "exaggeration": factor}})
    scene = space_axes()
    drawn = np.concatenate(
        [at, at + factor * shift, np.stack([np.asarray(links[axis]) for axis in "xyz"], axis=1)]
    )
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    half = 0.55 * float((high - low).max())
    for axis, middle in zip("xyz", ((low + high) / 2).tolist(), strict=True):
        scene[f"{axis}axis"] |= {"range": [middle - half, middle + half]}
    figure.update_layout(scene=scene, margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure
