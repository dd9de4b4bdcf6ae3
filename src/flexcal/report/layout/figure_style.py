"""Common style of all figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from flexcal.report.layout.palette import AXIS, GRID, INK, PAGE, QUIET

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', sans-serif"


def canvas(height: int, *, legend: bool = True) -> go.Figure:
    """An empty figure in the report's look; `height` in pixels."""
    return _styled(go.Figure(), height, legend)


def panels(
    rows: int,
    columns: int,
    height: int,
    titles: Sequence[str] = (),
    *,
    legend: bool = True,
    row_gap: float | None = None,
    column_gap: float = 0.045,
) -> go.Figure:
    """A grid of small panels with one title each, in the report's look; gaps are shares of the figure."""
    figure = make_subplots(
        rows,
        columns,
        subplot_titles=tuple(titles) or None,
        horizontal_spacing=column_gap if columns > 1 else 0.0,
        vertical_spacing=(0.26 / rows if row_gap is None else row_gap) if rows > 1 else 0.0,
    )
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


def _styled(figure: go.Figure, height: int, legend: bool) -> go.Figure:
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
    layout = figure.layout.to_plotly_json()
    for key in dict.fromkeys((*layout, "xaxis", "yaxis")):
        if key.startswith(("xaxis", "yaxis")):
            layout[key] = layout.get(key, {}) | axis | ({"zeroline": False} if key[0] == "x" else {})
    for title in layout.get("annotations", ()):
        title |= {"font": {"size": 12, "color": QUIET}, "yshift": -2}
    figure.layout = layout | dict(
        template="none",
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


def millimetre_axis(figure: go.Figure, axis: str = "y", title: str = "error / mm") -> None:
    """A logarithmic axis in millimetres with plain numbers at 1, 2 and 5."""
    ticks = [m * 10.0**e for e in range(-4, 3) for m in (1, 2, 5)]
    update = figure.update_yaxes if axis == "y" else figure.update_xaxes
    update(type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks], title_text=title)
