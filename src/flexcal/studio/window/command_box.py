"""The command that runs: its line, progress, messages, and how it ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexcal.studio.window.markup import command_text, folded, paragraph

if TYPE_CHECKING:
    import viser

    from flexcal.studio.commands import CommandRun, CommandRunner
    from flexcal.studio.project import Project

_MESSAGES = 12
"""Messages that are shown, the latest."""


class CommandBox:
    """The latest command of a window.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added.
    runner : CommandRunner
        The commands.
    project : Project
        The folder that they run in.
    """

    def __init__(self, gui: viser.GuiApi, runner: CommandRunner, project: Project):
        self._runner, self._project = runner, project
        self._shown: tuple[object, ...] = ()
        self._folder = gui.add_folder("Command", visible=False)
        with self._folder:
            self._text = gui.add_html("")
            self._bar = gui.add_progress_bar(0.0, animated=True)
            self._cancel = gui.add_button("Cancel", color="red")
        self._cancel.on_click(lambda _: runner.cancel())

    def put_away(self) -> None:
        """Hide a command that has ended."""
        run = self._runner.current
        if run is not None and run.status != "running":
            self._folder.visible = False

    def refresh(self) -> None:
        """Show the present state of the latest command."""
        run = self._runner.current
        if run is None:
            return
        state = (run, run.status, run.stage, len(run.messages))
        if state == self._shown:
            return
        self._shown = state
        running = run.status == "running"
        self._text.content = command_text(f"$ {run.line}") + _ending(run, self._project)
        self._bar.value = 100.0 * (run.stage[1] if run.stage else 0.0)
        for element, visible in ((self._bar, running), (self._cancel, running), (self._folder, True)):
            if element.visible != visible:
                element.visible = visible


def _ending(run: CommandRun, project: Project) -> str:
    if run.status == "running":
        return paragraph(f"{run.stage[0]} …" if run.stage else "starting …")
    if run.status == "cancelled":
        return paragraph("cancelled; nothing was written.", "warning")
    told = [m for m in run.messages if not m.startswith(("next: ", "flexcal: "))][-_MESSAGES:]
    messages = "".join(paragraph(project.told(message), "faint") for message in told)
    failed = run.status == "failed"
    ending = (project.told(run.error), "bad") if failed else (f"done in {run.seconds:.1f} s", "good")
    return paragraph(*ending) + (folded("what it said", messages) if told else "")
