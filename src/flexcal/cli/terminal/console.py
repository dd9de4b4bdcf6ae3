"""Output of a verb: results to standard output, progress and messages to standard error."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from flexcal.printable import printable
from flexcal.progress import Progress

if TYPE_CHECKING:
    from rich.console import Console as RichConsole
    from rich.table import Table

PROGRESS = "FLEXCAL_PROGRESS"
_WIDTH = 120
"""Columns where the output is no terminal."""
_PERIOD = 600.0
"""Seconds over which the time left is estimated: a task of a study may take minutes."""
_STEP = 0.01
"""Smallest share between two lines of progress."""


@dataclass(frozen=True)
class Console:
    """The two streams of one run; with `json`, standard output gets one document and nothing else."""

    json: bool
    _streams: dict[str, Any] = field(default_factory=dict, repr=False)

    def show(self, table: Table) -> None:
        """A table of results; not with `json`."""
        if not self.json:
            self._rich("out").print(table)

    def say(self, text: str) -> None:
        """A line of text beside the results; to standard error with `json`."""
        print(printable(text), file=sys.stderr if self.json else sys.stdout)

    def finish(self, document: Mapping[str, Any], following: str) -> None:
        """End a verb: what to do next, and the JSON document with `json`."""
        self.say(f"next: {following}")
        if self.json:
            from flexcal.jobs.result_files import json_text

            print(json_text(document))

    @contextmanager
    def progress(self) -> Iterator[Progress]:
        """A function `progress(stage, share)` that draws a bar a stage on standard error, where that is a terminal.

        Where it is none, it writes one line when a stage begins; with FLEXCAL_PROGRESS=json in the environment, for programs, JSON objects
        with "stage" and "share", a line each.
        """
        if os.environ.get(PROGRESS) == "json":
            yield _json_lines()
            return
        rich = self._rich("error")
        if not rich.is_terminal:
            yield _stage_lines()
            return
        from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        tasks: dict[str, TaskID] = {}
        columns = (
            TextColumn("{task.description:<14}", markup=False),
            BarColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        with Bars(*columns, console=rich, speed_estimate_period=_PERIOD) as bars:

            def advance(stage: str, share: float) -> None:
                if stage not in tasks:
                    tasks[stage] = bars.add_task(printable(stage), total=1.0)
                bars.update(tasks[stage], completed=min(share, 1.0))

            yield advance

    def _rich(self, name: str) -> RichConsole:
        from flexcal.cli.terminal.safe_console import SafeConsole

        if name not in self._streams:
            stream = sys.stdout if name == "out" else sys.stderr
            width = None if stream.isatty() else _WIDTH
            self._streams[name] = SafeConsole(file=stream, width=width)
        return self._streams[name]


def _json_lines() -> Progress:
    told: dict[str, float] = {}

    def advance(stage: str, share: float) -> None:
        share = round(min(share, 1.0), 3)
        if share in (0.0, 1.0) or share - told.get(stage, -1.0) >= _STEP:
            told[stage] = share
            print(json.dumps({"stage": stage, "share": share}), file=sys.stderr, flush=True)

    return advance


def _stage_lines() -> Progress:
    seen: set[str] = set()

    def advance(stage: str, share: float) -> None:
        if stage not in seen:
            seen.add(stage)
            print(f"{printable(stage)} …", file=sys.stderr)

    return advance
