"""The pose that is selected, in all figures and on the robot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence


class Selection:
    """The selected pose, by its key (the number in the file, as text); shared by tables, figures and the scene.

    Attributes
    ----------
    key : str or None
        The selected pose; None for none.
    table : str
        Name, without ending, of the plan or table that the pose is of; empty where it was not said.
    """

    def __init__(self) -> None:
        self.key: str | None = None
        self.table = ""
        self._listeners: list[Callable[[], None]] = []

    def listen(self, listener: Callable[[], None]) -> None:
        """Call `listener` after each change."""
        self._listeners.append(listener)

    def of(self, table: str) -> None:
        """Say which plan or table, by its name without ending, the shown poses are of; a pose of another one is deselected.

        Those of a plan and of the table measured after it have the same numbers, and the same name.
        """
        if table != self.table:
            self.table, self.key = table, None

    def pick(self, key: str | None) -> None:
        """Select a pose; the same one again deselects it."""
        self.key = None if key == self.key else key
        for listener in self._listeners:
            listener()


def pose_keys(numbers: Sequence[int]) -> list[str]:
    """Key of every row of a table in the selection: the number of its pose, and its row where the pose has several."""
    counts = Counter(numbers)
    return [f"{n}.{row + 1}" if counts[n] > 1 else f"{n}" for row, n in enumerate(numbers)]
