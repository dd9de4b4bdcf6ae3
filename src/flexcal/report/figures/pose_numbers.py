"""Predicted tool error against the number of poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.calibration_errors import millimetre_axis
from flexcal.report.figures.canvas import canvas, positive, single
from flexcal.report.palette import AXIS, ELASTIC, NOMINAL, QUIET, RIGID

_COLOURS = (ELASTIC, NOMINAL, QUIET)
_NUMBERS = [m * 10**e for e in range(5) for m in (1, 2, 5)]


def pose_numbers(
    numbers: Sequence[int], errors: Mapping[str, Sequence[float]], plan: int, wanted: float | None
) -> go.Figure:
    """Named `errors` (mm) against the `numbers` of poses, both logarithmic; the number of the `plan` and the `wanted` error marked."""
    figure = canvas(400)
    for colour, (name, values) in zip(_COLOURS, errors.items(), strict=False):
        figure.add_trace(
            go.Scatter(
                x=single(numbers), y=positive(np.asarray(values)), mode="lines+markers", name=name,
                line={"color": colour, "width": 2}, marker={"size": 5, "color": colour},
                hovertemplate="%{x} poses: %{y:.4f} mm",
            )
        )  # fmt: skip
    figure.add_vline(x=plan, line={"color": AXIS, "width": 1.5, "dash": "dash"})
    if wanted is not None:
        figure.add_hline(y=wanted, line={"color": RIGID, "width": 1.5, "dash": "dot"})
    figure.update_xaxes(type="log", title_text="poses", tickvals=_NUMBERS)
    millimetre_axis(figure, title="predicted tool error / mm")
    return figure
