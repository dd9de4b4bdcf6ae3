"""A part of the step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from flexcal.studio.window import Window


class Part(ABC):
    """A part of the step; one is open at a time.

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
        """Add its elements at the current place of the GUI."""

    @abstractmethod
    def refresh(self) -> None:
        """Show the present state of the folder, in which there is a calibration, and of the selection."""

    @abstractmethod
    def close(self) -> None:
        """Remove its nodes from the scene."""
