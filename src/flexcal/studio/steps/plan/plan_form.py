"""What is asked of a plan: fields, and the command line that they make."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from flexcal.errors import InputError
from flexcal.studio.commands import command_line
from flexcal.studio.project import ROBOT, read_plan_file
from flexcal.studio.steps.plan.fields import Fields
from flexcal.studio.window import command_text, paragraph

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel
    from flexcal.studio.window import Window


class PlanForm(ABC):
    """Fields for one kind of plan, at the current place of the window's GUI.

    Parameters
    ----------
    window : Window
        Where they are added.
    model : RobotModel
        The robot.

    Attributes
    ----------
    subject : str
        What it plans, for people.
    kind : str
        `kind` of the plan, in files.
    verb : str
        Verb after `flexcal design`.
    button : str
        What its button says.
    file : str
        Name of the plan's file by default.
    """

    subject: ClassVar[str]
    kind: ClassVar[str]
    verb: ClassVar[str]
    button: ClassVar[str]
    file: ClassVar[str]

    def __init__(self, window: Window, model: RobotModel):
        self.window, self.model = window, model
        self.fields = Fields(window, self.subject, self.changed)
        self.add()
        self._out = self.fields.text("File", "File of the plan", self.file, hint="In the folder.")
        self._line = window.gui.add_html("")
        self.show_line()

    @abstractmethod
    def add(self) -> None:
        """Add the fields."""

    @abstractmethod
    def options(self) -> tuple[str, ...]:
        """Options of the command line that the fields stand for; those at their defaults are left out."""

    @property
    def note(self) -> str:
        """What the fields mean, in a sentence; empty where they speak for themselves."""
        return ""

    @property
    def out(self) -> str:
        """Name of the plan's file.

        Raises
        ------
        InputError
            For a name outside the folder, or of a file that is there and is no plan.
        """
        name = self._out.value.strip()
        path = self.window.project.path(name)
        if path.suffix != ".yaml":
            raise InputError("E-STUDIO-030", f"the plan's file is '{name}'; give a name that ends in .yaml.")
        if name == ROBOT or (path.exists() and read_plan_file(path) is None):
            raise InputError(
                "E-STUDIO-031", f"{name} is there and is no plan; give another name, such as {self.file}."
            )
        return name

    @property
    def arguments(self) -> tuple[str, ...]:
        """The command line after `flexcal`; raises `InputError` where a field does not make sense."""
        return ("design", self.verb, ROBOT, *self.options(), "--out", self.out)

    def close(self) -> None:  # noqa: B027  most forms show nothing in the scene
        """Remove what it shows in the scene."""

    def changed(self) -> None:
        """Take note that a field has changed."""
        self.show_line()

    def show_line(self) -> None:
        """Show the command line as the fields make it."""
        try:
            line = command_line(self.arguments)
        except InputError as problem:
            self._line.content = paragraph(self.window.project.told(str(problem)), "bad")
            return
        note = paragraph(self.note, "faint") if self.note else ""
        replaced = self.window.project.path(self.out).exists()
        if replaced:
            note += paragraph(f"{self.out} is there, and is replaced by a new plan.", "faint")
        self._line.content = command_text(f"$ {line}") + note


def option(name: str, value: float, default: float | None = None) -> tuple[str, ...]:
    """An option with its number; none where that is the default."""
    return () if value == default else (name, f"{value:.10g}")
