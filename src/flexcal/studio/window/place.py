"""A place in the GUI whose elements are replaced together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


class Place:
    """A place in the GUI, made at the current one, whose elements are replaced together.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is.
    """

    def __init__(self, gui: viser.GuiApi):
        self._gui = gui
        self._outer = gui.add_folder(None)
        self._inner: viser.GuiFolderHandle | None = None

    @contextmanager
    def anew(self) -> Iterator[None]:
        """Remove what is there; what is added inside takes its place."""
        if self._inner is not None:
            self._inner.remove()
        with self._outer:
            self._inner = self._gui.add_folder(None)
        with self._inner:
            yield

    @property
    def visible(self) -> bool:
        """Whether it is shown."""
        return self._outer.visible

    @visible.setter
    def visible(self, shown: bool) -> None:
        if self._outer.visible != shown:
            self._outer.visible = shown
