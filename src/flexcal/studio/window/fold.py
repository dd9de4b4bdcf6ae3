"""A part of the GUI that is shown on demand, by mouse or keyboard."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


def add_fold(gui: viser.GuiApi, title: str, *, is_open: bool = False) -> viser.GuiFolderHandle:
    """Add a tick box and a place below it that is shown while it is ticked; to be used as a context.

    viser's own folders open with the mouse only.
    """
    box = gui.add_checkbox(title, is_open)
    place = gui.add_folder(None, visible=is_open)

    def show(_: object) -> None:
        place.visible = box.value

    box.on_update(show)
    return place
