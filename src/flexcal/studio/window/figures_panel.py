"""The panel of figures beside the scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

_WIDTH = 380
"""Pixels: at 1280 the scene keeps a third."""
_NARROW = 600
"""Pixels beside the steps below which the figures begin folded, so that the scene is seen."""


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

    def show(self, figures: Mapping[str, Callable[[], object]]) -> None:
        """Show figures in place of those before: each function adds one, under its title, at the current place of the GUI."""
        narrow = self._is_narrow()
        self.clear()
        if not figures:
            return
        self._panel = self._gui.add_panel()
        for title, add in figures.items():
            with self._panel.add_tab(title):
                add()
        self._panel.dock_left()
        self._panel.set_width(_WIDTH)
        if narrow:
            self._panel.minimize()

    def _is_narrow(self) -> bool:
        """Whether the scene of every window is narrow: the panel is the same in all."""
        widths = [client.camera.image_width for client in self._server.get_clients().values()]
        taken = 0 if self._panel is None else _WIDTH
        return bool(widths) and max(widths) + taken < _NARROW

    def clear(self) -> None:
        """Remove the figures."""
        if self._panel is not None:
            self._panel.remove()
            self._panel = None
