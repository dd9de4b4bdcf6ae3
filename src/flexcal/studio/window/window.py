"""The window of a project."""

from __future__ import annotations

import queue
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from typing import TYPE_CHECKING

from flexcal.errors import FlexcalError
from flexcal.studio.commands import CommandRun, CommandRunner
from flexcal.studio.project import ROBOT, Choices, Project
from flexcal.studio.window.command_box import CommandBox
from flexcal.studio.window.figures_panel import FiguresPanel
from flexcal.studio.window.markup import Tone, paragraph, step_links
from flexcal.studio.window.selection import Selection
from flexcal.studio.window.shown_robot import ShownRobot
from flexcal.studio.window.step import Step

if TYPE_CHECKING:
    import viser

    from flexcal.model.robot import RobotModel

_PERIOD = 0.2
"""Seconds between looks at the folder and the command that runs."""
_TICK = 0.1
"""Seconds between looks at what arrives at the open step by itself."""
_PATIENCE = 10.0
"""Seconds that a form waits for its turn."""
_WIDTH = 400
_DESCRIBING = (ROBOT, ".urdf")
"""Endings of the files that describe the robot without its estimates; plans and measurements do not."""
_PROGRAM_ERROR = "an error of the program, not of your files; the terminal has the details"


class Window:
    """The window of a project: steps, the command that runs, messages; the same in every browser that shows it.

    Parameters
    ----------
    server : viser.ViserServer
        Server that it is shown by.
    project : Project
        The folder.
    steps : sequence of type of Step
        The steps, in their order.

    Attributes
    ----------
    gui, scene
        viser's; steps add to them.
    choices : Choices
        What was chosen, kept in the folder.
    runner : CommandRunner
        Commands that run in processes of their own.
    robot : ShownRobot
        The robot in the scene.
    figures : FiguresPanel
        Figures on the left.
    selection : Selection
        The selected pose.
    dark : bool
        Whether the window is dark.
    """

    def __init__(self, server: viser.ViserServer, project: Project, steps: Sequence[type[Step]]):
        self.gui, self.scene, self.project = server.gui, server.scene, project
        self.server = server
        self.choices = Choices.read(project.folder)
        self.runner = CommandRunner(project.folder)
        self.selection = Selection()
        self.robot = ShownRobot(server, project.folder)
        self._actions: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._stamp: object = None
        self._models: dict[bool, tuple[object, RobotModel]] = {}
        self._stopped = threading.Event()
        self.dark = self.choices.get("dark", False)
        self._theme()
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(_WIDTH)
        self._steps = [step(self) for step in steps]
        titles = [step.title for step in self._steps]
        self._heading = server.gui.add_html("")
        self._message = server.gui.add_html("", visible=False)
        self._place = server.gui.add_folder(None)
        self._commands = CommandBox(server.gui, self.runner, project)
        self.figures = FiguresPanel(server)
        self._add_hotkeys(titles)
        self.selection.listen(self._selected)
        self._open: Step | None = None
        self._entered = ""
        first = self.choices.get("step", titles[0])
        self._going: str | None = None
        self._open_step(first if first in titles else titles[0])

    def run(self) -> None:
        """Carry out what clicks ask for, and watch the folder and the command that runs, until `stop`."""
        watched = ticked = 0.0
        while not self._stopped.is_set():
            with suppress(queue.Empty):
                self._carry_out(self._actions.get(timeout=max(0.0, ticked + _TICK - time.monotonic())))
            if time.monotonic() - ticked >= _TICK:
                ticked = time.monotonic()
                self._carry_out(self._tick)
            if time.monotonic() - watched >= _PERIOD:
                watched = time.monotonic()
                self._carry_out(self._watch)

    def stop(self) -> None:
        """End `run`, and cancel the command that runs."""
        self._stopped.set()
        self.runner.cancel()

    def post(self, action: Callable[[], None]) -> None:
        """Have what a click asks for carried out by the thread of `run`, in order; an error is shown as its sentence."""
        self._actions.put(action)

    def enter(self, texts: Mapping[str, str]) -> bool:
        """Have the open step take what was typed into its form, and say whether it did; called in any other thread than that of `run`."""
        taken: Future[bool] = Future()

        def take() -> None:
            if not taken.set_running_or_notify_cancel():
                return  # the page was told that it was not taken
            try:
                if self._open is not None and texts["once"] != self._entered:  # a browser may send it again
                    self.say("")
                    self._open.enter(texts)
                    self._entered = texts["once"]
                taken.set_result(True)
            except BaseException:
                taken.set_result(False)
                raise

        self.post(take)
        try:
            return taken.result(_PATIENCE)
        except TimeoutError:
            return False if taken.cancel() else taken.result()

    def _carry_out(self, action: Callable[[], None]) -> None:
        try:
            with self._place:  # what it adds belongs to the step
                action()
        except FlexcalError as problem:
            self.say(f"{problem} [{problem.code}]", "bad")
        except OSError as problem:
            self.say(f"{problem.filename or 'a file'}: {problem.strerror or problem}.", "bad")
        except Exception as problem:
            traceback.print_exc(file=sys.stderr)
            self.say(f"{type(problem).__name__}: {_PROGRAM_ERROR}.", "bad")
        if self._going is not None:
            title, self._going = self._going, None
            self._open_step(title)

    def say(self, text: str, tone: Tone = "plain") -> None:
        """Show a sentence above the step, names of files relative to the folder; an empty one removes it."""
        self._message.content = paragraph(self.project.told(text), tone) if text else ""
        self._message.visible = bool(text)

    def go_to(self, title: str) -> None:
        """Open a step in place of the one that is open, when the present action has ended; another title does nothing."""
        if title in [step.title for step in self._steps]:
            self._going = title

    def _open_step(self, title: str) -> None:
        if self._open is not None:
            self._carry_out(self._open.close)
        self._place.remove()
        self.figures.clear()
        self._commands.put_away()
        self.say("")
        self._open = next(step for step in self._steps if step.title == title)
        self._show_robot()
        self.choices.put("step", title)
        self._heading.content = step_links([step.title for step in self._steps], title, self.project.name)
        self._place = self.gui.add_folder(None, order=self._message.order + 0.5)
        self._carry_out(self._open.open)
        self._carry_out(self._open.refresh)

    def button(
        self, label: str, action: Callable[[], None], *, hint: str = "", main: bool = False
    ) -> viser.GuiButtonHandle:
        """A button that has `action` carried out; `main` for the one that goes on."""

        def pressed() -> None:
            self.say("")  # what was said before is of something else
            action()

        button = self.gui.add_button(label, hint=hint or None, color=None if main else "gray")
        button.on_click(lambda _: self.post(pressed))
        return button

    def command(self, arguments: Sequence[str], then: Callable[[CommandRun], None] | None = None) -> None:
        """Run a command line of flexcal in the folder; the step is refreshed at its end, and `then` called where it succeeded.

        Raises `FlexcalError` while another one runs.
        """

        def ended(run: CommandRun) -> None:
            if run.status == "done" and then is not None:
                then(run)
            if self._open is not None:
                self._open.refresh()

        self.say("")
        self.runner.start(arguments, ended)
        self._commands.refresh()

    def model(self, *, estimates: bool = True) -> RobotModel:
        """The robot as its files describe it now, with or without what was estimated; raises `InputError` where they cannot be used."""
        from flexcal.model.robot import RobotModel

        stamp = self.project.stamp()
        if not estimates:  # measured rows do not change it
            stamp = tuple(entry for entry in stamp if entry[0].endswith(_DESCRIBING))
        kept = self._models.get(estimates)
        if kept is None or kept[0] != stamp:
            kept = (stamp, RobotModel.from_yaml(self.project.robot_file, estimates=estimates))
            self._models[estimates] = kept
        return kept[1]

    def _show_robot(self) -> None:
        try:
            self.robot.show(self.model(estimates=False))
        except FlexcalError as problem:
            self.robot.clear()
            self.robot.problem = self.project.told(str(problem))

    def _tick(self) -> None:
        if self._open is not None:
            self._open.tick()

    def _watch(self) -> None:
        self.runner.settle()
        self._commands.refresh()
        if self._open is None:
            return
        stamp = self.project.stamp()
        if stamp != self._stamp:
            self._stamp = stamp
            self._show_robot()
            self._open.refresh()

    def _selected(self) -> None:
        if self._open is not None:
            self._open.refresh()

    def _theme(self) -> None:
        self.gui.configure_theme(
            dark_mode=self.dark, show_logo=False, show_share_button=False, control_width="large"
        )
        self.gui.set_panel_label("flexcal studio")

    def _toggle_dark(self) -> None:
        self.dark = not self.dark
        self.choices.put("dark", self.dark)
        self._theme()
        if self._open is not None:
            self._open.refresh()  # the figures get other colours; what is typed stays

    def _add_hotkeys(self, titles: Sequence[str]) -> None:
        for number, title in enumerate(titles, 1):
            command = self.gui.add_command(f"{number}. {title}", hotkey=str(number))  # pyright: ignore[reportArgumentType]
            command.on_trigger(lambda _, title=title: self.post(lambda: self.go_to(title)))
        dark = self.gui.add_command("Dark or light", hotkey="D")
        dark.on_trigger(lambda _: self.post(self._toggle_dark))
        none = self.gui.add_command("Deselect the pose", hotkey="escape")
        none.on_trigger(lambda _: self.post(lambda: self.selection.pick(None)))
