"""A plan of exciting trajectories: use of the limits, paths, and predicted standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.report.figures.robot_arm import space_axes
from flexcal.report.layout import (
    AXIS,
    ELASTIC,
    INK,
    NOMINAL,
    RIGID,
    Figure,
    Trace,
    as_float32,
    canvas,
    log_ticks,
    panels,
    positive,
    trace,
)

_DASHES = ("solid", "dot", "dash", "dashdot")
_COLOURS = (ELASTIC, RIGID, NOMINAL, INK)


def limit_shares(
    time: np.ndarray, joints: Sequence[str], motions: Mapping[str, Mapping[str, np.ndarray]]
) -> Figure:
    """Shares (N, n) of the limits against time (N,), s, one panel a quantity, one motion shown at a time.

    Traces carry `meta = {"trajectory": label}`, by which the page chooses. Lines at ±100 % are the limits.
    """
    quantities = list(next(iter(motions.values())))
    figure = panels(len(quantities), 1, 210 * len(quantities) + 80, quantities, row_gap=0.09)
    for number, (label, shares) in enumerate(motions.items()):
        for row, quantity in enumerate(quantities, start=1):
            for joint, name in enumerate(joints):
                figure.add_trace(
                    trace(
                        "scatter",
                        x=as_float32(time),
                        y=as_float32(100 * shares[quantity][:, joint]),
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


def prior_gains(names: Sequence[str], after: np.ndarray) -> Figure:
    """Standard deviation (p,) after the measurements relative to that before, logarithmic; the lower, the more was learned."""
    order = np.argsort(after)[::-1]
    figure = canvas(80 + 17 * len(names), legend=False)
    figure.add_trace(
        trace(
            "scatter",
            x=positive(after[order]),
            y=[names[k] for k in order],
            mode="markers",
            marker={"color": ELASTIC, "size": 7},
            hovertemplate="%{y}: %{x:.3g} of the prior standard deviation<extra></extra>",
        )
    )
    low = int(np.floor(np.log10(max(float(after.min(initial=1.0)), 1e-9))))
    figure.update_xaxes(log_ticks(low, 0))
    figure.update_xaxes(type="log", range=[low, 0.1], title_text="standard deviation, relative to before")
    return figure


_ARMS = 6


def swept_paths(chains: Mapping[str, np.ndarray], links: Mapping[str, Trace]) -> Figure:
    """Path of the arm's last corner in each motion, from corners (N, corners, 3), m, and the `links` at its beginning, one motion shown
    at a time.

    Traces carry `meta = {"trajectory": label}`, by which the page chooses.
    """
    figure = canvas(560)
    for number, (label, corners) in enumerate(chains.items()):
        shown = {"meta": {"trajectory": label}, "visible": number == 0, "hoverinfo": "skip"}
        path = np.concatenate([corners[:, -1], corners[:1, -1]])
        arms = corners[:: max(1, len(corners) // _ARMS)]
        parted = np.concatenate([arms, np.full((len(arms), 1, 3), np.nan)], axis=1).reshape(-1, 3)
        figure.add_trace(links[label] | {"meta": shown["meta"], "visible": shown["visible"]})
        for points, name, colour, width in (
            (parted, "the arm on its path", NOMINAL, 3.0),
            (path, "path of the point", ELASTIC, 4.0),
        ):
            x, y, z = (as_float32(points[:, axis]) for axis in range(3))
            line = {"color": colour, "width": width}
            figure.add_trace(trace("scatter3d", x=x, y=y, z=z, mode="lines", name=name, line=line, **shown))
    figure.update_layout(scene=space_axes(), margin={"l": 0, "r": 0, "t": 40, "b": 0})
    return figure
