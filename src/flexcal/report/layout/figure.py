"""Figures as plotly.js reads them: traces and a layout. Plotly's own objects, which check each property, took a fifth of a calibration."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import plotly.graph_objects as go

Trace = dict[str, Any]
"""A trace: its `type` and its properties (https://plotly.com/javascript/reference)."""


def trace(kind: str, **properties: Any) -> Trace:
    """A trace of a kind, as "scatter"; properties that are None are left out."""
    return {"type": kind} | {name: value for name, value in properties.items() if value is not None}


class Figure:
    """Traces `data` and a `layout`, in one panel or in a grid of `rows` and `columns` with an x and a y axis each.

    Properties are not checked here, but by `plotly`.
    """

    def __init__(self, rows: int = 1, columns: int = 1):
        self.data: list[Trace] = []
        self.layout: dict[str, Any] = {}
        self._rows, self._columns = rows, columns

    def add_trace(self, trace: Trace, row: int = 1, col: int = 1) -> None:
        """Add a trace to the panel in a row and a column, counted from 1; one in space has none."""
        flat = trace["type"] not in _IN_SPACE
        number = (row - 1) * self._columns + col
        gridded = self._rows * self._columns > 1
        self.data.append(trace | (_axes_of(number) if flat and gridded else {}))

    def update_layout(self, **properties: Any) -> None:
        """Change properties of the layout; what is nested keeps its other properties, and what is None is removed."""
        _update(self.layout, properties)

    def update_xaxes(
        self,
        properties: Mapping[str, Any] | None = None,
        *,
        row: int | None = None,
        col: int | None = None,
        title_text: str | None = None,
        **more: Any,
    ) -> None:
        """Change properties of the x axes of all panels, or of those of a row or a column."""
        self._update_axes("xaxis", row, col, title_text, {**(properties or {}), **more})

    def update_yaxes(
        self,
        properties: Mapping[str, Any] | None = None,
        *,
        row: int | None = None,
        col: int | None = None,
        title_text: str | None = None,
        **more: Any,
    ) -> None:
        """Change properties of the y axes of all panels, or of those of a row or a column."""
        self._update_axes("yaxis", row, col, title_text, {**(properties or {}), **more})

    def add_vline(self, x: float, line: Mapping[str, Any]) -> None:
        """Add a vertical line at `x` to all panels with traces."""
        self._add_lines({"x0": x, "x1": x, "y0": 0, "y1": 1}, line, across="y")

    def add_hline(self, y: float, line: Mapping[str, Any]) -> None:
        """Add a horizontal line at `y` to all panels with traces."""
        self._add_lines({"x0": 0, "x1": 1, "y0": y, "y1": y}, line, across="x")

    def add_annotation(self, **properties: Any) -> None:
        """Add a text."""
        self.layout.setdefault("annotations", []).append(properties)

    def specification(self) -> dict[str, Any]:
        """Data and layout in values that JSON has; arrays of numbers in base64."""
        return {"data": _plain(self.data), "layout": _plain(self.layout)}

    def plotly(self) -> go.Figure:
        """The figure as an object of Plotly.

        Raises
        ------
        ValueError
            Where Plotly does not know a property, or not its value.
        """
        import plotly.graph_objects as go

        return go.Figure(self.data, self.layout | {"template": "none"})

    def show(self) -> None:
        """Show the figure as Plotly does, in a browser or a notebook."""
        self.plotly().show()

    def _ipython_display_(self) -> None:
        self.show()

    def _update_axes(
        self, kind: str, row: int | None, col: int | None, title: str | None, changes: dict[str, Any]
    ) -> None:
        if title is not None:
            changes = changes | {"title": {"text": title}}
        for number in range(1, self._rows * self._columns + 1):
            at_row, at_column = divmod(number - 1, self._columns)
            if row in (None, at_row + 1) and col in (None, at_column + 1):
                _update(self.layout.setdefault(f"{kind}{axis_suffix(number)}", {}), changes)

    def _add_lines(self, ends: Mapping[str, float], line: Mapping[str, Any], across: str) -> None:
        panels = [_axes_of(1)]
        if self._rows * self._columns > 1:
            drawn = {trace["xaxis"] for trace in self.data}
            every = (_axes_of(number) for number in range(1, self._rows * self._columns + 1))
            panels = [axes for axes in every if axes["xaxis"] in drawn]
        for axes in panels:
            refs = {
                f"{axis}ref": axes[f"{axis}axis"] + (" domain" if axis == across else "") for axis in "xy"
            }
            self.layout.setdefault("shapes", []).append({"type": "line", "line": dict(line), **ends, **refs})


_IN_SPACE = ("scatter3d", "mesh3d", "cone")
_TYPED = {"float32": "f4", "float64": "f8", "int32": "i4"}
"""Arrays that plotly.js reads from base64, by the name of their type in NumPy."""


def axis_suffix(number: int) -> str:
    """What follows the name of an axis of a panel, counted from 1."""
    return "" if number == 1 else str(number)


def _axes_of(number: int) -> dict[str, str]:
    return {"xaxis": f"x{axis_suffix(number)}", "yaxis": f"y{axis_suffix(number)}"}


def _update(old: dict[str, Any], changes: Mapping[str, Any]) -> None:
    for name, value in changes.items():
        if value is None:
            old.pop(name, None)
        elif isinstance(value, Mapping):
            own = old.get(name)
            old[name] = dict(own) if isinstance(own, Mapping) else {}
            _update(old[name], value)
        else:
            old[name] = value


def _plain(value: Any) -> Any:
    if isinstance(value, str | bool | int | None):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items() if item is not None}
    if isinstance(value, np.ndarray):
        typed = _TYPED.get(value.dtype.name)
        if typed is None or not value.size:
            return _plain(value.tolist())
        spec = {"dtype": typed, "bdata": base64.b64encode(value.tobytes()).decode("ascii")}
        return spec | ({"shape": str(value.shape)[1:-1]} if value.ndim > 1 else {})
    if isinstance(value, np.generic):
        return _plain(value.item())
    return [_plain(item) for item in value]
