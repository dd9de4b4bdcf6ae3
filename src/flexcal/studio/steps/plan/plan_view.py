"""A plan, as the window shows it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from flexcal.data.plans import page_beside
from flexcal.studio.window import file_link

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel
    from flexcal.studio.window import Window


class PlanView(ABC):
    """A plan beside the scene, in it, and in figures.

    Parameters
    ----------
    window : Window
        Where it is shown.
    model : RobotModel
        The robot.
    name : str
        Name of the plan's file.
    """

    def __init__(self, window: Window, model: RobotModel, name: str):
        self.window, self.model, self.name = window, model, name

    @abstractmethod
    def add(self) -> None:
        """Add what stands beside the scene, at the current place of the GUI."""

    @abstractmethod
    def figures(self) -> Mapping[str, Callable[[], None]]:
        """Figures by title, as `FiguresPanel.show` takes them."""

    def refresh(self) -> None:  # noqa: B027  not every plan has something to select
        """Show the selection."""

    def tick(self) -> None:  # noqa: B027  nor something that moves
        """Move on; called some times a second."""

    @abstractmethod
    def close(self) -> None:
        """Remove its nodes from the scene."""

    def add_link(self) -> None:
        """Add a link to the page beside the plan, where there is one."""
        page = page_beside(self.window.project.folder / self.name)
        if page.is_file():
            name = page.relative_to(self.window.project.folder).as_posix()
            self.window.gui.add_html(file_link(name, "open the plan's page"))
