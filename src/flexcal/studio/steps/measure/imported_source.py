"""Measurements of another program, converted by `flexcal import`."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.errors import InputError
from flexcal.studio.commands import CommandRun, command_line
from flexcal.studio.steps.measure.motor_fields import MotorFields
from flexcal.studio.steps.measure.row_source import RowSource
from flexcal.studio.window import Place, command_text, paragraph, table
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.studio.steps.measure.measuring import Measuring
    from flexcal.studio.window import Window

_ENDINGS = (
    *(".csv", ".tsv", ".txt", ".dat", ".asc", ".xlsx", ".xlsm", ".xls", ".xlsb", ".ods", ".mat", ".parquet"),
    *(".uff", ".unv", ".mcap", ".db3", ".bag"),
)
_NOTEWORTHY = 2.0
"""Misfit, mm, by which another place of the point must be better to be told."""
_NONE = (
    "There is no table in the folder yet: put the file of the other program there (text, Excel, MAT, Parquet, universal file or ROS "
    "recording), and open this step again."
)


class ImportedSource(RowSource):
    """A whole file with columns and units of its own; it becomes the table of rows where that is empty, else a table beside it."""

    title = "a file in another format"

    def __init__(self, window: Window, measuring: Measuring, refresh: Callable[[], None]):
        super().__init__(window, measuring, refresh)
        self._file: Any = None
        self._shown = ""

    def add(self) -> None:
        """Add the file, the meaning of its columns, the command line, and buttons that show how it is read and that import it."""
        window, gui = self.window, self.window.gui
        names = self._names()
        if not names:
            gui.add_html(paragraph(_NONE, "faint"))
            return
        self._file = gui.add_dropdown("File", names, initial_value=window.choices.among("import", names))
        self._map = gui.add_text(
            "Columns",
            window.choices.get("import map", ""),
            hint="empty: as recognised; else their meaning, as: q1=A1[deg] q2=-A2[deg]+90 x=X[mm]",
        )
        self._sigma = gui.add_number(
            "1σ / mm",
            window.choices.number("import sigma", 0.0),
            min=0.0,
            step=0.001,
            hint="of the instrument, a coordinate; 0: as the file states it",
        )
        self._motors = MotorFields(window, self._changed)
        self._unchecked = gui.add_checkbox(
            "Even if they do not fit the robot",
            False,
            hint="written although the points are far from where the nominal robot has them, as where a joint's zero is off by degrees",
        )
        self._line = gui.add_html("")
        for field in (self._file, self._map, self._sigma, self._unchecked):
            field.on_update(lambda _: window.post(self._changed))
        window.button("Show how it is read", lambda: self._run(written=False))
        window.button("Import", lambda: self._run(written=True), main=True)
        self._read = gui.add_html("")
        self._point = Place(gui)
        self._keep()

    def tick(self) -> None:
        """Show the table that the present rows let it be written to."""
        if self._file is not None and self._shown != self._out:
            self._shown = self._out
            self._keep()

    def _names(self) -> list[str]:
        names = self.window.project.files(*_ENDINGS, *(ending.upper() for ending in _ENDINGS))
        rows = self.measuring.series.purpose.rows
        return [name for name in names if "/" not in name and name != rows]

    @property
    def _out(self) -> str:
        """The table of rows where it has none, else one named after the file."""
        series = self.measuring.series
        name = series.purpose.rows
        return name if not series.rows else f"{Path(self._file.value).stem}-imported.csv"

    def _arguments(self, *, written: bool) -> tuple[str, ...]:
        try:
            columns = shlex.split(self._map.value)
        except ValueError as problem:
            raise InputError(
                "E-STUDIO-047", f"Columns: {problem}; put each meaning with spaces in quotes."
            ) from problem
        return (
            *("import", "robot.yaml", self._file.value),
            *(("--map", *columns) if columns else ()),
            *(("--sigma", f"{self._sigma.value:.10g}") if self._sigma.value > 0 else ()),
            *self._motors.options,
            *(("--unchecked",) if self._unchecked.value else ()),
            *(("--out", self._out) if written else ()),
        )

    def _changed(self) -> None:
        self.window.say("")
        self._read.content = ""
        with self._point.anew():
            pass
        self._keep()

    def _keep(self) -> None:
        choices = self.window.choices
        choices.put("import", self._file.value)
        choices.put("import map", self._map.value)
        choices.put("import sigma", float(self._sigma.value))
        self._motors.keep()
        self._line.content = command_text(f"$ {command_line(self._arguments(written=True))}")

    def _tell(self, document: dict[str, Any]) -> None:
        """Show which columns were read as what, and the place of the point on the tool where another one fits far better."""
        self._read.content = _how_read(document)
        nominal = document.get("nominal") or {}
        before, after = nominal.get("rms_mm", 0.0), nominal.get("rms_with_point_moved_mm", 0.0)
        with self._point.anew():
            if after > 0.5 * before or before - after < _NOTEWORTHY or nominal["doubtful"]:
                return
            place = ", ".join(f"{value / MILLIMETRE:.1f}" for value in nominal["point_moved_to"])
            self.window.gui.add_html(
                paragraph(
                    f"The nominal robot misses the points by {before:.1f} mm (rms). With the measured point at ({place}) mm in its frame, "
                    f"instead of where robot.yaml has it, by {after:.1f} mm: measure it on the tool, or take this place.",
                    "warning",
                )
            )
            arguments = (*self._arguments(written=False), "--write-point")
            self.window.button(
                "Write this place to robot.yaml",
                lambda: self.window.command(arguments, lambda run: self._tell(run.document)),
                hint=f"$ {command_line(arguments)}",
            )

    def _run(self, *, written: bool) -> None:
        out = self._out
        if written and self.window.project.path(out).exists():
            raise InputError("E-STUDIO-048", f"{out} is there already; rename it, and import again.")

        def told(run: CommandRun) -> None:
            self._tell(run.document)
            if written and out != self.measuring.series.purpose.rows:
                self.window.say(
                    f"{out} is written beside {self.measuring.series.purpose.rows}; step 4 takes it too.",
                    "good",
                )

        self.window.command(self._arguments(written=written), told)


def _how_read(document: dict[str, Any]) -> str:
    """HTML of which columns were read as what; empty for a document without them."""
    columns = document.get("columns", {})
    if not columns:
        return ""
    rows = [(name, _column(read), read["unit"] or "", read["why"]) for name, read in columns.items()]
    left = "".join(
        paragraph(f"left out: {name}: {why}", "faint") for name, why in document.get("left_out", {}).items()
    )
    return table(("", "column", "unit", "recognised by"), rows, height="16em") + left


def _column(read: dict[str, Any]) -> str:
    gain, offset = read["gain"], read["offset"]
    factor = "" if gain == 1 else "\N{MINUS SIGN}" if gain == -1 else f"{gain:g} · "
    return f"{factor}{read['from']}" + (f" {offset:+g}" if offset else "")
