"""The panel of figures beside the scene."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

_WIDTH = 380
"""Pixels: at 1280 the scene keeps a third."""
_NARROW = 600
"""Pixels beside the steps below which the figures begin folded, so that the scene is seen."""
_LATE = 2.0
"""Seconds after which a browser has told how wide its scene is now."""


class FiguresPanel:
    """A panel on the left with a tab a figure.

    Parameters
    ----------
    server : viser.ViserServer
        Server that shows it.
    """

    def __init__(self, server: viser.ViserServer):
        self._server, self._gui = server, server.gui
        self._panel: viser.PanelHandle | None = None
        self._is_folded = False
        self._before = (-_LATE, 0)

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
        self._is_folded = self._is_narrow()
        if self._is_folded:
            self._panel.minimize()

    def _is_narrow(self) -> bool:
        """Whether the scene of every window is narrow: the panel is the same in all."""
        when, before = self._before
        widths = self._widths()
        if time.monotonic() - when < _LATE:
            widths.append(before)  # browsers do not know yet that the panel has gone
        return bool(widths) and max(widths) < _NARROW

    def _widths(self) -> list[int]:
        """Pixels of the scene in every window, as it last told."""
        return [client.camera.image_width for client in self._server.get_clients().values()]

    def clear(self) -> None:
        """Remove the figures."""
        if self._panel is not None:
            taken = 0 if self._is_folded else _WIDTH
            self._before = (time.monotonic(), max(self._widths(), default=0) + taken)
            self._panel.remove()
            self._panel = None
