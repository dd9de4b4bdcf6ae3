"""The figures of a report in the window."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from flexcal.studio.window.markup import paragraph
from flexcal.studio.window.place import Place

if TYPE_CHECKING:
    import plotly.graph_objects as go
    import viser

    from flexcal.report.layout import FigureBlock
    from flexcal.studio.window.window import Window

_POINTS = 3000
"""Points of a curve that are sent, at most: a figure is a few hundred pixels wide."""


class ReportFigures:
    """Figures of a report, one at a time, chosen by title.

    Parameters
    ----------
    gui : viser.GuiApi
        Where they are added, at the current place.
    blocks : sequence of FigureBlock
        The figures, one or more.
    dark : bool
        Whether the window is dark.
    """

    def __init__(self, gui: viser.GuiApi, blocks: Sequence[FigureBlock], *, dark: bool):
        self._gui, self._dark = gui, dark
        import plotly.graph_objects as go

        self._blocks = {block.title: block for block in blocks}
        titles = tuple(self._blocks)
        self._choice = gui.add_dropdown("Figure", titles, initial_value=titles[0])
        self._selectors = Place(gui)
        self._plot = gui.add_plotly(go.Figure(), config=_CONFIG)
        self._caption = gui.add_html("")
        self._choice.on_update(lambda _: self._show())
        self._show()

    def _show(self) -> None:
        block = self._blocks[self._choice.value]
        chosen = {selector.key: selector.options[0] for selector in block.selectors}
        self._selectors.visible = bool(block.selectors)
        with self._selectors.anew():
            for selector in block.selectors:
                choice = self._gui.add_dropdown(selector.label, selector.options)

                def changed(_, key: str = selector.key, choice: Any = choice) -> None:
                    chosen[key] = choice.value
                    self._draw(block, chosen)

                choice.on_update(changed)
        self._caption.content = paragraph(block.caption, "faint")
        self._draw(block, chosen)

    def _draw(self, block: FigureBlock, chosen: Mapping[str, str]) -> None:
        figure = _figure(block, chosen, self._dark)
        height = figure.to_plotly_json()["layout"].get("height", _WIDTH)
        self._plot.aspect = min(max(height / _WIDTH, 0.5), 2.5)
        self._plot.figure = figure


def figure_tab(window: Window, blocks: Sequence[FigureBlock]) -> dict[str, Callable[[], object]]:
    """A tab of the figures panel with figures of a report; none without any. The arm in space is left out, as the scene shows it."""
    shown = [block for block in blocks if block.slider is None]
    return {"Figures": lambda: ReportFigures(window.gui, shown, dark=window.dark)} if shown else {}


_WIDTH = 380
_CONFIG = {"displayModeBar": False, "responsive": False}


def _figure(block: FigureBlock, chosen: Mapping[str, str], dark: bool) -> go.Figure:
    """The figure with the traces of what is chosen, few enough points, and the colours of the window."""
    import plotly.graph_objects as go

    from flexcal.report.layout import dark_colours

    shown = []
    for trace in cast("Any", block.figure.plotly()).data:
        meta = trace.meta or {}
        if chosen and any(key in meta for key in chosen):
            trace.visible = all(meta.get(key, option) == option for key, option in chosen.items())
        if trace.visible is not False:
            shown.append(_decimated(trace))
    figure = go.Figure(shown, {**block.figure.layout, "template": "none"})
    if not dark:
        return figure
    text = str(figure.to_json())
    for light, colour in dark_colours().items():
        text = text.replace(light, colour)
    return go.Figure(json.loads(text))


def _decimated(trace: Any) -> Any:
    """A trace of lines with every k-th point, where it has more than can be seen."""
    x, y = getattr(trace, "x", None), getattr(trace, "y", None)
    if trace.type != "scatter" or x is None or y is None or len(x) <= _POINTS:
        return trace
    step = -(-len(x) // _POINTS)
    trace.x, trace.y = x[::step], y[::step]
    return trace
