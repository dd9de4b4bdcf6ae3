"""A step of the work: what its part of the window shows and does."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from flexcal.studio.window.window import Window


class Step(ABC):
    """A step of the work; one is open at a time.

    Parameters
    ----------
    window : Window
        Where it is shown.
    """

    title: ClassVar[str]

    def __init__(self, window: Window):
        self.window = window

    @abstractmethod
    def open(self) -> None:
        """Add what the step shows: elements at the current place of `window.gui`, nodes of the scene, figures."""

    def refresh(self) -> None:  # noqa: B027  a step that shows no files has nothing to do
        """Show the present state of the project's files and of the selection; called after either has changed."""

    def tick(self) -> None:  # noqa: B027  a step that nothing arrives at has nothing to do
        """Look at what may arrive by itself; called some times a second."""

    def enter(self, texts: Mapping[str, str]) -> None:  # noqa: B027  a step without an `entry_form` is sent nothing
        """Take what was typed into the step's `entry_form`: texts by label, and as "of" what `data-of` of the page had then.

        Raises `InputError` for texts that cannot be taken; they stay in their fields.
        """

    def close(self) -> None:  # noqa: B027  elements and figures are removed by the window
        """Remove the step's nodes from the scene."""
