"""The pose that is selected, in all figures and on the robot."""

from __future__ import annotations

from collections.abc import Callable


class Selection:
    """The selected pose, by its key (the number in the file, as text); shared by tables, figures and the scene.

    Attributes
    ----------
    key : str or None
        The selected pose; None for none.
    """

    def __init__(self) -> None:
        self.key: str | None = None
        self._listeners: list[Callable[[], None]] = []

    def listen(self, listener: Callable[[], None]) -> None:
        """Call `listener` after each change."""
        self._listeners.append(listener)

    def pick(self, key: str | None) -> None:
        """Select a pose; the same one again deselects it."""
        self.key = None if key == self.key else key
        for listener in self._listeners:
            listener()
