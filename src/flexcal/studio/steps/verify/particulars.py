"""Particulars of a measurement for sheets that are signed."""

from __future__ import annotations

from collections.abc import Callable

from flexcal.studio.window import Window

_PARTICULARS = {
    "--instrument": "Device",
    "--instrument-serial": "Its no.",
    "--robot-serial": "Robot no.",
    "--operator": "By",
    "--date": "Date",
}


class Particulars:
    """Fields at the current place of a window's GUI; what is left empty is a line to fill in by hand.

    Parameters
    ----------
    window : Window
        Where they are added.
    changed : callable
        Called in the window's thread after each change.
    """

    def __init__(self, window: Window, changed: Callable[[], None]):
        self._window, self._changed = window, changed
        self._fields = {
            option: window.gui.add_text(label, window.choices.get(option, ""))
            for option, label in _PARTICULARS.items()
        }
        for field in self._fields.values():
            field.on_update(lambda _: window.post(self._keep))

    @property
    def options(self) -> tuple[str, ...]:
        """Options of the command line that they stand for."""
        given = [(option, field.value.strip()) for option, field in self._fields.items()]
        return tuple(word for pair in given if pair[1] for word in pair)

    def _keep(self) -> None:
        for option, field in self._fields.items():
            self._window.choices.put(option, field.value)
        self._changed()
