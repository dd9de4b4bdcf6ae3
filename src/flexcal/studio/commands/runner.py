"""The commands of a window: one at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.files.transaction import refuse_linked_folder
from flexcal.studio.commands.command_run import CommandRun


class CommandRunner:
    """Runs command lines in a project's folder, one at a time, and remembers them.

    Parameters
    ----------
    folder : Path
        The project's folder.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self.runs: list[CommandRun] = []
        self._then: Callable[[CommandRun], None] | None = None

    @property
    def current(self) -> CommandRun | None:
        """The latest command; None before the first."""
        return self.runs[-1] if self.runs else None

    @property
    def is_busy(self) -> bool:
        """Whether a command is running or its end has not been told yet."""
        return self.current is not None and (self.current.status == "running" or self._then is not None)

    def start(self, arguments: Sequence[str], then: Callable[[CommandRun], None]) -> CommandRun:
        """Start a command; `then` is called by `settle` when it has ended.

        Raises `FlexcalError` while another one runs, and where its output would lie behind a link.
        """
        if self.is_busy:
            assert self.current is not None
            raise FlexcalError(
                "E-STUDIO-042", f"'{self.current.line}' is still running; wait for its end or cancel it."
            )
        for option, value in pairwise(arguments):
            if option == "--out":  # the project's choice, not a person's
                refuse_linked_folder(self.folder / value / value, self.folder)
        run = CommandRun(arguments, self.folder)
        self.runs.append(run)
        self._then = then
        return run

    def settle(self) -> None:
        """Tell the end of a command that has ended; called again and again by the window."""
        run, then = self.current, self._then
        if run is None or then is None or run.status == "running":
            return
        self._then = None
        then(run)

    def cancel(self) -> None:
        """Cancel the command that runs."""
        if self.current is not None:
            self.current.cancel()
