"""Measured rows of a project, a table as poses.csv, with a journal from which every change can be undone."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from flexcal.data.poses import EXCLUDED
from flexcal.errors import InputError, unreadable
from flexcal.files.formats import parse_json
from flexcal.files.transaction import append_lines, read_text, whole_lines, write_text

ROWS, STATION = "poses.csv", "station"
_DONE = '{"do": "done"}'
"""Line of the journal after a change of the table."""


@dataclass(frozen=True)
class MeasuredRow:
    """Row of the table: its `cells` by column, and the reason for which it is `excluded` (empty: it is used)."""

    cells: Mapping[str, str]
    excluded: str = ""


@dataclass(frozen=True)
class Source:
    """A file from which rows are taken: its `name`, and the bytes up to the `end` of the last line that was."""

    name: str
    end: int


@dataclass(frozen=True)
class MeasuredRows:
    """A table of a project, as poses.csv, and its journal, as poses.history.jsonl, in a `folder`.

    A change is appended to the journal, and then made in the table; when the process is killed between, it does not count. The texts of
    cells are kept as they are. A row that an undo takes out of the table stays in the journal.
    """

    folder: Path
    name: str = ROWS

    @property
    def path(self) -> Path:
        """The table."""
        return self.folder / self.name

    @property
    def history(self) -> Path:
        """The journal, one JSON object a line."""
        return self.path.with_suffix(".history.jsonl")

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the table, without `excluded`; none where there is no file yet."""
        return tuple(name for name in self._table().columns if name != EXCLUDED)

    def rows(self) -> tuple[MeasuredRow, ...]:
        """Rows in the order of measuring, excluded ones too; none where there is no file yet. Raises `InputError` for a broken line."""
        return self._table().rows

    def append(self, rows: Sequence[Mapping[str, str]], source: Source | None = None) -> None:
        """Append rows, texts by column, and keep how far their `source` is taken with them.

        Raises `InputError` where their columns are not those of the table.
        """
        table = self._table()
        columns = table.columns or tuple(dict.fromkeys(name for cells in rows for name in cells))
        for cells in rows:
            lacking, further = sorted({*columns} - {*cells} - {EXCLUDED}), sorted({*cells} - {*columns})
            if lacking or further:
                odd = [f"has no {', '.join(lacking)}"] * bool(lacking)
                odd += [f"has {', '.join(further)} beside them"] * bool(further)
                raise InputError(
                    "E-STUDIO-010",
                    f"all rows of {self.path} must have its columns, but the new row {' and '.join(odd)}; go on as the rows before were "
                    "measured, or move the table away to begin another.",
                )
            if not all(map(_is_cell, cells.values())):
                raise InputError(
                    "E-STUDIO-052",
                    f"a value of the new row of {self.path} has a line end in it; remove that.",
                )
        added = tuple(MeasuredRow(dict(cells)) for cells in rows)
        entry = {"do": "append", "row": len(table.rows), "cells": [dict(cells) for cells in rows]}
        if source is not None:
            entry |= {"from": source.name, "end": source.end}
        self._write(_Table(columns, (*table.rows, *added), table.head), entry)

    def taken(self) -> dict[str, int]:
        """Bytes of every source that are taken, by its name; those of rows that an undo took out too."""
        return {str(one["from"]): int(one["end"]) for one in self._entries() if "from" in one}

    def move_station(self, row: int, name: str, first: str) -> None:
        """Let the rows from one on, counted from 0, that are of its station be of another one, `name`; beyond the last row none are.

        A table without a column of stations gets it: the rows before are of the station `first`.
        """
        table = self._table()
        rows = [MeasuredRow({STATION: first} | dict(one.cells), one.excluded) for one in table.rows]
        moved = rows[row].cells[STATION] if row < len(rows) else ""
        for k in range(row, len(rows)):
            if rows[k].cells[STATION] == moved:
                rows[k] = MeasuredRow({**rows[k].cells, STATION: name}, rows[k].excluded)
        entry: dict[str, Any] = {"do": "station", "row": row, "after": [one.cells[STATION] for one in rows]}
        entry["before"] = [one.cells.get(STATION) for one in table.rows]
        columns = table.columns if STATION in table.columns else (*table.columns, STATION)
        entry["new"] = columns != table.columns
        self._write(_Table(columns, tuple(rows), table.head), entry)

    def count_taken(self) -> dict[str, int]:
        """Number of rows that were taken from every source, by its name; those that an undo took out too."""
        counts: dict[str, int] = {}
        for one in self._entries():
            if "from" in one:
                counts[str(one["from"])] = counts.get(str(one["from"]), 0) + len(one["cells"])
        return counts

    def exclude(self, row: int, reason: str) -> None:
        """Exclude a row, counted from 0; raises `InputError` without a reason, and for a row that is not there."""
        if not reason.strip():
            raise InputError("E-STUDIO-011", "a row is excluded for a reason that is kept with it; say why.")
        self._mark(row, " ".join(reason.split()))

    def include(self, row: int) -> None:
        """Use a row, counted from 0, again; raises `InputError` for one that is not there."""
        self._mark(row, "")

    def undo(self) -> str | None:
        """Take back the last change that is not taken back yet, and return it in words; None where there is none.

        Raises `InputError` where another program has changed what it would take back.
        """
        done: list[dict[str, Any]] = []
        for entry in self._entries():
            if entry["do"] != "undo":
                done.append(entry)
            elif done:
                done.pop()
        if not done:
            return None
        table, last = self._table(), done[-1]
        row, rows, columns = int(last["row"]), list(table.rows), table.columns
        if last["do"] == "station":
            if [one.cells.get(STATION) for one in rows] != last["after"]:
                raise self._changed()
            for k, station in enumerate(last["before"]):
                others = {
                    name: cell for name, cell in rows[k].cells.items() if name != STATION or not last["new"]
                }
                rows[k] = MeasuredRow(
                    others if last["new"] else {**others, STATION: station}, rows[k].excluded
                )
            columns = tuple(name for name in columns if name != STATION or not last["new"])
            words = f"the rows from row {row + 1} on are of the station before"
        elif last["do"] == "append":
            count = len(last["cells"])
            if [dict(one.cells) for one in rows[row : row + count]] != last["cells"]:
                raise self._changed()
            del rows[row : row + count]
            words = f"{count} row{'s' * (count > 1)} taken out"
        else:
            if row >= len(rows) or rows[row].excluded != last["reason"]:
                raise self._changed()
            rows[row] = MeasuredRow(rows[row].cells, last["before"])
            words = f"row {row + 1} {'excluded' if last['before'] else 'used'} again"
        self._write(_Table(columns, tuple(rows), table.head), {"do": "undo"})
        return words

    def _mark(self, row: int, reason: str) -> None:
        table = self._table()
        if not 0 <= row < len(table.rows):
            raise InputError(
                "E-STUDIO-012", f"{self.path} has {len(table.rows)} rows, and none of number {row + 1}."
            )
        rows, before = list(table.rows), table.rows[row].excluded
        rows[row] = MeasuredRow(rows[row].cells, reason)
        entry = {"do": "exclude", "row": row, "reason": reason, "before": before}
        self._write(_Table(table.columns, tuple(rows), table.head), entry)

    def _write(self, table: _Table, entry: Mapping[str, Any]) -> None:
        stored, line = self._stored(), json.dumps({**entry, "on": self._digest()}, ensure_ascii=False)
        if self._has_open(stored):
            kept = (json.dumps(one, ensure_ascii=False) for one in stored[:-1])
            write_text(self.history, "".join(f"{one}\n" for one in (*kept, line)))
        else:
            append_lines(self.history, [line])
        write_text(self.path, table.text())
        append_lines(self.history, [_DONE], synchronised=False)

    def _entries(self) -> list[dict[str, Any]]:
        stored = self._stored()
        return [one for one in (stored[:-1] if self._has_open(stored) else stored) if one["do"] != "done"]

    def _has_open(self, stored: Sequence[Mapping[str, Any]]) -> bool:
        """Whether the process was killed between the last entry and the change of the table, so that the entry does not count."""
        return bool(stored) and stored[-1]["do"] != "done" and stored[-1].get("on") == self._digest()

    def _stored(self) -> list[dict[str, Any]]:
        try:
            stored = [
                parse_json(self.history, line, "") for line in whole_lines(self.history) if line.strip()
            ]
            if all(map(_is_change, stored)):
                return stored
            problem: Exception | str = "a line is no change"
        except InputError as error:
            problem = error
        except OSError as error:
            raise unreadable(self.history, error) from error
        raise InputError(
            "E-STUDIO-013",
            f"{self.history} is not the journal of {self.name} ({problem}); move it away, and go on without undo.",
        )

    def _digest(self) -> str:
        return hashlib.sha256(_text(self.path).encode()).hexdigest()[:16]

    def _table(self) -> _Table:
        return _parsed(self.path, _text(self.path))

    def _changed(self) -> InputError:
        return InputError(
            "E-STUDIO-014",
            f"{self.path} was changed by another program since, so the last change cannot be taken back.",
        )


@dataclass(frozen=True)
class _Table:
    """Columns and rows of a table, and the lines before its header."""

    columns: tuple[str, ...]
    rows: tuple[MeasuredRow, ...]
    head: tuple[str, ...] = ()

    @classmethod
    def parsed(cls, path: Path, text: str) -> _Table:
        """Table of a text; raises `InputError` for a line with more or fewer cells than columns."""
        text = text.lstrip("\ufeff")
        lines = text.removesuffix("\n").split("\n") if text else []
        first = next((k for k, line in enumerate(lines) if line.strip() and not line.startswith("#")), None)
        if first is None:
            return cls((), (), tuple(lines))
        columns, rows = split_line(lines[first]), []
        for number, line in enumerate(lines[first + 1 :], start=first + 2):
            if not line.strip():
                continue
            cells = split_line(line)
            if len(cells) != len(columns):
                raise InputError(
                    "E-STUDIO-015",
                    f"{path} line {number}: there are {len(cells)} values, but the header names {len(columns)} columns; correct the line.",
                )
            named = dict(zip(columns, cells, strict=True))
            rows.append(MeasuredRow(named, named.pop(EXCLUDED, "")))
        return cls(tuple(columns), tuple(rows), tuple(lines[:first]))

    def text(self) -> str:
        """The table as CSV, with a column `excluded` where a row is."""
        columns = list(self.columns)
        if EXCLUDED not in columns and any(row.excluded for row in self.rows):
            columns.append(EXCLUDED)
        stream = io.StringIO()
        stream.writelines(line + "\n" for line in self.head)
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for row in self.rows:
            writer.writerow([row.excluded if name == EXCLUDED else row.cells[name] for name in columns])
        return stream.getvalue()


def _is_change(entry: Any) -> bool:
    """Whether an entry of the journal has what taking it back needs."""
    if not isinstance(entry, dict) or not isinstance(entry.get("row", 0), int):
        return False
    match entry:
        case {"do": "undo" | "done"}:
            return True
        case {"do": "append", "row": _, "cells": [*rows]}:
            source = entry.get("from", ""), entry.get("end", 0)
            cells = [cell for row in rows if isinstance(row, dict) for cell in row.values()]
            return (
                all(isinstance(row, dict) for row in rows)
                and all(map(_is_cell, cells))
                and isinstance(source[0], str)
                and isinstance(source[1], int)
            )
        case {"do": "exclude", "row": _, "reason": reason, "before": before}:
            return _is_cell(reason) and _is_cell(before)
        case {"do": "station", "row": _, "before": [*before], "after": [*after], "new": bool()}:
            return len(before) == len(after) and all(
                one is None or _is_cell(one) for one in (*before, *after)
            )
    return False


def _is_cell(value: Any) -> bool:
    return isinstance(value, str) and "\n" not in value and "\r" not in value


@lru_cache(maxsize=4)
def _parsed(path: Path, text: str) -> _Table:
    """As `_Table.parsed`; a text is asked for several times until it changes."""
    return _Table.parsed(path, text)


def split_line(line: str) -> list[str]:
    """Cells of a line of CSV, without the blanks around them."""
    return [cell.strip() for cell in next(csv.reader([line]), [])]


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as problem:
        raise unreadable(path, problem) from problem
