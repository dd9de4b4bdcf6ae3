"""One command line, as it runs."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

Status = Literal["running", "done", "failed", "cancelled"]
_PATIENCE = 5.0
"""Seconds after which a command that was interrupted is killed."""
_LINES = 2000
"""Messages that are kept."""
_PROGRAM = (sys.executable, "-m", "flexcal.cli.main")


def command_line(arguments: Sequence[str]) -> str:
    """The line that has these arguments after `flexcal`, as typed in a terminal."""
    return shlex.join(["flexcal", *arguments])


class CommandRun:
    """A command line of flexcal in a process of its own, with its progress, messages and JSON document.

    Parameters
    ----------
    arguments : sequence of str
        After `flexcal`, as typed in the project's folder; `--json` is added.
    folder : Path
        The project's folder, in which it runs.
    """

    def __init__(self, arguments: Sequence[str], folder: Path):
        self.arguments = tuple(arguments)
        self.folder = folder
        self.status: Status = "running"
        self.stages: dict[str, float] = {}
        self.messages: list[str] = []
        self.document: dict[str, Any] = {}
        self.started = time.monotonic()
        self.seconds = 0.0
        self._cancelled = False
        environment = os.environ | {"FLEXCAL_PROGRESS": "json", "PYTHONUNBUFFERED": "1"}
        self._process = subprocess.Popen(
            [*_PROGRAM, *arguments, "--json"],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C in the terminal is the server's, which then cancels this
        )
        self._output = b""
        self._threads = [
            threading.Thread(target=target, daemon=True)
            for target in (self._read_output, self._read_messages)
        ]
        for thread in self._threads:
            thread.start()
        self._ending = threading.Thread(target=self._wait, daemon=True)
        self._ending.start()

    @property
    def line(self) -> str:
        """The command line that does the same in a terminal."""
        return command_line(self.arguments)

    @property
    def stage(self) -> tuple[str, float] | None:
        """The latest stage and the share of it that is done; None before the first."""
        return next(reversed(self.stages.items()), None)

    @property
    def error(self) -> str:
        """The sentence that says why it failed; empty where it did not."""
        if self.status != "failed":
            return ""
        told = [line.removeprefix("flexcal: ") for line in self.messages if line.startswith("flexcal: ")]
        return (
            told[-1]
            if told
            else (self.messages[-1] if self.messages else "the command ended without a word.")
        )

    def cancel(self) -> None:
        """Interrupt it as Ctrl-C does, which leaves no file half-written; a process that does not listen is killed."""
        if self.status != "running":
            return
        self._cancelled = True
        self._signal(signal.SIGINT)
        threading.Timer(_PATIENCE, self._kill).start()

    def wait(self, timeout: float | None = None) -> None:
        """Wait until it has ended, at most `timeout` seconds."""
        self._ending.join(timeout)

    def _kill(self) -> None:
        if self._process.poll() is None:
            self._signal(signal.SIGKILL)

    def _signal(self, number: int) -> None:
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            return

    def _read_output(self) -> None:
        assert self._process.stdout is not None
        self._output = self._process.stdout.read()

    def _read_messages(self) -> None:
        assert self._process.stderr is not None
        for raw in self._process.stderr:
            self._take(raw.decode("utf-8", "replace").rstrip("\n"))

    def _take(self, text: str) -> None:
        if text.startswith('{"stage"'):
            try:
                told = json.loads(text)
                stage, share = str(told["stage"]), float(told["share"])
            except (ValueError, RecursionError, KeyError, TypeError):
                return
            self.stages.pop(stage, None)
            self.stages[stage] = share
        elif text.strip() and len(self.messages) < _LINES:
            self.messages.append(text)

    def _wait(self) -> None:
        code = self._process.wait()
        for thread in self._threads:
            thread.join()
        self.seconds = time.monotonic() - self.started
        if code == 0:
            try:
                self.document = json.loads(self._output)
            except ValueError:
                self.document = {}
        self.status = "done" if code == 0 else "cancelled" if self._cancelled else "failed"
