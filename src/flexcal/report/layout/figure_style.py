"""Common style of all figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.report.layout.figure import Figure, axis_suffix
from flexcal.report.layout.palette import AXIS, GRID, INK, PAGE, QUIET

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', sans-serif"


def canvas(height: int, *, legend: bool = True) -> Figure:
    """An empty figure in the report's look; `height` in pixels."""
    return _styled(Figure(), height, legend)


def panels(
    rows: int,
    columns: int,
    height: int,
    titles: Sequence[str] = (),
    *,
    legend: bool = True,
    row_gap: float | None = None,
    column_gap: float = 0.045,
) -> Figure:
    """A grid of small panels with one title each, in the report's look; gaps are shares of the figure."""
    figure = Figure(rows, columns)
    gap = 0.26 / rows if row_gap is None else row_gap
    width, height_of_panel = (1 - column_gap * (columns - 1)) / columns, (1 - gap * (rows - 1)) / rows
    for number in range(rows * columns):
        row, column = divmod(number, columns)
        left, bottom = column * (width + column_gap), (rows - 1 - row) * (height_of_panel + gap)
        across, up = [left, min(left + width, 1.0)], [bottom, min(bottom + height_of_panel, 1.0)]
        suffix = axis_suffix(number + 1)
        figure.layout[f"xaxis{suffix}"] = {"anchor": f"y{suffix}", "domain": across}
        figure.layout[f"yaxis{suffix}"] = {"anchor": f"x{suffix}", "domain": up}
        if number < len(titles) and titles[number]:
            figure.add_annotation(
                x=sum(across) / 2, y=up[1], xref="paper", yref="paper", xanchor="center", yanchor="bottom", yshift=-2,
                text=titles[number], showarrow=False, font={"size": 12, "color": QUIET},
            )  # fmt: skip
    return _styled(figure, height, legend)


def as_float32(values: np.ndarray | Sequence[float]) -> np.ndarray:
    """Float32, which the page stores in base64; what it cannot hold is a gap."""
    whole = np.asarray(values, dtype=float)
    return np.where(np.abs(whole) <= np.finfo(np.float32).max, whole, np.nan).astype(np.float32)


def positive(values: np.ndarray) -> np.ndarray:
    """Float32 with everything that a log axis cannot show as a gap."""
    values = np.asarray(values, dtype=float)
    return as_float32(np.where(values > 0, values, np.nan))


def log_ticks(low: int, high: int, step: int = 1) -> dict[str, list]:
    """Tick values and labels 10ᵏ for a logarithmic axis, in plain characters that keep their size."""
    powers = range(low, high + 1, step)
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    return {
        "tickvals": [10.0**k for k in powers],
        "ticktext": ["1" if k == 0 else "10" if k == 1 else f"10{str(k).translate(raised)}" for k in powers],
    }


def _styled(figure: Figure, height: int, legend: bool) -> Figure:
    axis = {
        "gridcolor": GRID,
        "linecolor": AXIS,
        "zerolinecolor": AXIS,
        "tickcolor": AXIS,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "title": {"font": {"size": 12, "color": QUIET}, "standoff": 6},
        "automargin": True,
    }
    figure.update_xaxes(axis, zeroline=False)
    figure.update_yaxes(axis)
    figure.update_layout(
        height=height,
        font={"family": FONT, "size": 12, "color": INK},
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        margin={"l": 56, "r": 12, "t": 56 if legend else 26, "b": 46},
        showlegend=legend,
        legend={
            "orientation": "h",
            "x": 0,
            "xref": "container",
            "xanchor": "left",
            "y": 1,
            "yref": "container",
            "yanchor": "top",
            "font": {"size": 12},
            "bgcolor": "rgba(0,0,0,0)",
        },
        modebar={"bgcolor": "rgba(0,0,0,0)", "color": AXIS, "activecolor": QUIET},
        hoverlabel={"bgcolor": PAGE, "bordercolor": AXIS, "font": {"family": FONT, "size": 12, "color": INK}},
        hovermode="closest",
    )
    return figure


def millimetre_axis(figure: Figure, axis: str = "y", title: str = "error / mm") -> None:
    """A logarithmic axis in millimetres with plain numbers at 1, 2 and 5."""
    ticks = [m * 10.0**e for e in range(-4, 3) for m in (1, 2, 5)]
    update = figure.update_yaxes if axis == "y" else figure.update_xaxes
    update(type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks], title_text=title)
