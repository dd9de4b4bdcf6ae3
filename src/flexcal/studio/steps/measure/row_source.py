"""A source of measured rows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from flexcal.jobs.guidance import Source
    from flexcal.studio.steps.measure.measuring import Measuring
    from flexcal.studio.steps.measure.next_pose import NextPose
    from flexcal.studio.window import Window


class RowSource(ABC):
    """Where rows come from.

    Parameters
    ----------
    window : Window
        Where its elements are.
    measuring : Measuring
        What the rows come to.
    refresh : callable
        Shows them.
    """

    title: ClassVar[str]

    def __init__(self, window: Window, measuring: Measuring, refresh: Callable[[], None]):
        self.window, self.measuring, self._refresh = window, measuring, refresh

    @abstractmethod
    def add(self) -> None:
        """Add its elements at the current place of the GUI."""

    def tick(self) -> None:  # noqa: B027  nothing comes by itself
        """Take what has come; called some times a second."""

    def measure_next(self) -> None:  # noqa: B027  another program measures
        """Measure the next pose."""

    def enter(self, texts: Mapping[str, str]) -> None:  # noqa: B027  nothing is typed
        """Take what was typed, as `Step.enter`."""

    @property
    def following(self) -> NextPose | None:
        """The pose that is to be measured next; None where there is none, or it is not known yet."""
        return self.measuring.following(self.window.selection.key)

    def take(self, rows: Sequence[Mapping[str, str]], source: Source | None = None) -> None:
        """Take rows, texts by column, and show them; raises `InputError` for those that do not fit."""
        new = self.measuring.take(rows, source)
        names = ", ".join(f"'{name}'" for name in new)
        self.window.say(f"{names} is new, and was added to the stations of robot.yaml." if new else "")
        if self.window.selection.key is None:
            self._refresh()
        else:
            self.window.selection.pick(None)  # which refreshes
