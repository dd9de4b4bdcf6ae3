"""The panel of figures beside the scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

_WIDTH = 380
"""Pixels: at 1280 the scene keeps a third."""


class FiguresPanel:
    """A panel on the left with a tab a figure.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added.
    """

    def __init__(self, gui: viser.GuiApi):
        self._gui = gui
        self._panel: viser.PanelHandle | None = None

    def show(self, figures: Mapping[str, Callable[[], object]]) -> None:
        """Show figures in place of those before: each function adds one, under its title, at the current place of the GUI."""
        self.clear()
        if not figures:
            return
        self._panel = self._gui.add_panel()
        for title, add in figures.items():
            with self._panel.add_tab(title):
                add()
        self._panel.dock_left()
        self._panel.set_width(_WIDTH)

    def clear(self) -> None:
        """Remove the figures."""
        if self._panel is not None:
            self._panel.remove()
            self._panel = None
