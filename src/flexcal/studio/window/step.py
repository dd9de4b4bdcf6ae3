"""A step of the work: what its part of the window shows and does."""

from __future__ import annotations

from abc import ABC, abstractmethod
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

    def close(self) -> None:  # noqa: B027  elements and figures are removed by the window
        """Remove the step's nodes from the scene."""
