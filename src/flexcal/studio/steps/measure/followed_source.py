"""Rows that other programs write: a file that they append to, or a folder with a file a measurement."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.errors import InputError
from flexcal.jobs.guidance import ReadingGoesOn
from flexcal.studio.steps.measure.row_source import RowSource
from flexcal.studio.window import paragraph

if TYPE_CHECKING:
    from flexcal.jobs.guidance import FollowedFile
    from flexcal.studio.steps.measure.measuring import Measuring
    from flexcal.studio.window import Window

_PATIENCE = 0.15
"""Seconds for which rows are taken at one look, so that the window goes on."""
_AT_REST = 1.0
"""Seconds after which a file of a watched folder is whole."""
_REFUSED = 3
"""Lines that were left out and are shown, the latest."""


class _Followed(RowSource):
    """Files that grow, below one name in the project's folder."""

    label = ""
    hint = ""
    example = ""

    def __init__(self, window: Window, measuring: Measuring, refresh: Callable[[], None]):
        super().__init__(window, measuring, refresh)
        self._files: dict[str, FollowedFile] = {}
        self._refused: list[str] = []
        self._shown = ""
        self._of: object = None
        self._journal: tuple[object, dict[str, int], dict[str, int]] = ((), {}, {})

    def add(self) -> None:
        """Add the name, a button that begins or ends following it, and what has come."""
        gui = self.window.gui
        choices, begun = self.window.choices, f"{self.title} typed"
        self._name = gui.add_text(
            self.label, self.followed or choices.get(begun, self.example), hint=self.hint
        )
        self._name.on_update(lambda _: self.window.post(lambda: choices.put(begun, self._name.value)))
        self._button = self.window.button("", self._toggle)
        self._state = gui.add_html("")
        self._shown = ""
        self._label()

    @property
    def followed(self) -> str:
        """Name of what is followed; empty for nothing."""
        return self.window.choices.get(self._choice, "")

    @property
    def _choice(self) -> str:
        return f"{self.title} {self.measuring.series.purpose.rows}"

    @abstractmethod
    def _names(self, name: str) -> list[str]:
        """Names of the files that are there."""

    def tick(self) -> None:
        """Take the rows that have come."""
        name = self.followed
        if not name:
            return
        series = self.measuring.series
        if self._of is not series.model:
            self._files, self._of = {}, series.model
        problems: list[str] = []
        names, until = self._names(name), time.monotonic() + _PATIENCE
        for one in names:
            if time.monotonic() > until:
                break  # the others at the next look
            try:
                self._read(one)
            except InputError as problem:
                self._files.pop(one, None)
                problems.append(str(problem))
        waiting = (
            "waiting for the next line"
            if names
            else f"waiting for it to come into {self.window.project.name}"
        )
        text = paragraph(f"following {name}: {self._count(names)} rows taken so far, {waiting}.", "faint")
        text += "".join(paragraph(problem, "bad") for problem in [*problems, *self._refused])
        if text != self._shown:
            self._shown = self._state.content = text

    def _read(self, name: str) -> None:
        from flexcal.jobs.guidance import FollowedFile, RowReader, Source

        series = self.measuring.series
        path = self.window.project.path(name)
        if name not in self._files:
            self._files[name] = FollowedFile(path, series.model, self._taken().get(name, 0))
        file = self._files[name]
        try:
            rows = file.new_rows(is_whole=self._is_whole(path))
        except ReadingGoesOn as problem:
            self._refuse(problem)
            return
        good = []
        for row in rows:
            try:
                RowReader(path, file.columns, series.model).poses([row])
                good.append(row)
            except InputError as problem:
                self._refuse(problem)
        if good:
            self.take(good, Source(name, file.end))

    def _taken(self) -> dict[str, int]:
        """Bytes of every file that are taken."""
        table = self.measuring.series.table
        status = table.history.stat() if table.history.exists() else None
        stamp = None if status is None else (status.st_mtime_ns, status.st_size)
        if self._journal[0] != stamp:
            self._journal = (stamp, table.taken(), table.count_taken())
        return self._journal[1]

    def _is_whole(self, path: Path) -> bool:
        """Whether the last line of a file is complete without an end of line."""
        return False

    def _refuse(self, problem: InputError) -> None:
        sentence = str(problem)
        self._refused = [*(one for one in self._refused if one != sentence), sentence][-_REFUSED:]

    def _count(self, names: list[str]) -> int:
        self._taken()
        return sum(self._journal[2].get(name, 0) for name in names)

    def _toggle(self) -> None:
        name = "" if self.followed else self._name.value.strip()
        if name:
            self._check(name)
        self._refused, self._shown = [], ""
        self.window.choices.put(self._choice, name)
        self._state.content = ""
        self._label()
        self.tick()

    def _check(self, name: str) -> None:
        """Raise `InputError` for a name that cannot be followed."""
        self.window.project.path(name)
        if Path(name) == Path(self.measuring.series.purpose.rows):
            raise InputError(
                "E-STUDIO-036",
                f"{name} is the table that the rows are kept in; let the other program write a file of its own.",
            )

    def _label(self) -> None:
        self._button.label = f"Stop following {self.followed}" if self.followed else "Follow"


class FileSource(_Followed):
    """A file that another program appends to, with a header as of a table of measured poses."""

    title = "a file that grows"
    label = "File in the folder"
    hint = (
        "CSV with a header such as pose,q1,…,q6,x,y,z (rad, m); another program appends a line a measurement"
    )
    example = "tracker.csv"

    def _names(self, name: str) -> list[str]:
        return [name] if self.window.project.path(name).is_file() else []


class FolderSource(_Followed):
    """A folder in which another program leaves a file a measurement."""

    title = "a watched folder"
    label = "Folder in the folder"
    hint = "a CSV file a measurement, each with a header such as pose,q1,…,q6,x,y,z (rad, m)"
    example = "measurements"

    def _names(self, name: str) -> list[str]:
        place = self.window.project.path(name)
        files = [path for path in place.glob("*.csv") if path.is_file() and not path.is_symlink()]
        files.sort(key=lambda path: (_changed(path), path.name))
        return [f"{name}/{path.name}" for path in files]

    def _is_whole(self, path: Path) -> bool:
        return time.time() - _changed(path) > _AT_REST


def _changed(path: Path) -> float:
    """Time of the last change of a file, s; 0 of one that has gone."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
