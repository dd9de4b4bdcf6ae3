"""Use of the limits by a planned motion, joint by joint over one period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from flexcal.report.figures.canvas import panels, single
from flexcal.report.palette import AXIS, ELASTIC, INK, NOMINAL, RIGID

_DASHES = ("solid", "dot", "dash", "dashdot")
_COLOURS = (ELASTIC, RIGID, NOMINAL, INK)


def limit_shares(
    time: np.ndarray, joints: Sequence[str], motions: Mapping[str, Mapping[str, np.ndarray]]
) -> go.Figure:
    """Shares (N, n) of the limits against time (N,), s, one panel a quantity, one motion shown at a time.

    Traces carry `meta = {"trajectory": label}`, by which the page chooses. Lines at ±100 % are the limits.
    """
    quantities = list(next(iter(motions.values())))
    figure = panels(len(quantities), 1, 210 * len(quantities) + 80, quantities, row_gap=0.09)
    for number, (label, shares) in enumerate(motions.items()):
        for row, quantity in enumerate(quantities, start=1):
            for joint, name in enumerate(joints):
                figure.add_trace(
                    go.Scatter(
                        x=single(time),
                        y=single(100 * shares[quantity][:, joint]),
                        name=name,
                        legendgroup=name,
                        showlegend=row == 1,
                        mode="lines",
                        line={
                            "color": _COLOURS[joint % len(_COLOURS)],
                            "dash": _DASHES[joint // len(_COLOURS) % len(_DASHES)],
                            "width": 1.6,
                        },
                        meta={"trajectory": label},
                        visible=number == 0,
                        hovertemplate="%{x:.2f} s: %{y:.1f} %",
                    ),
                    row=row,
                    col=1,
                )
    for edge in (-100, 100):
        figure.add_hline(edge, line={"color": AXIS, "dash": "dash", "width": 1.5})
    figure.update_yaxes(range=[-112, 112], nticks=5)
    figure.update_yaxes(title_text="share of the limit / %", row=(len(quantities) + 1) // 2, col=1)
    figure.update_xaxes(matches="x", showticklabels=False)
    figure.update_xaxes(showticklabels=True, title_text="time / s", row=len(quantities), col=1)
    return figure
