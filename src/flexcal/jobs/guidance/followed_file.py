"""A table to which another program appends while it measures."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from flexcal.data.tables import LARGEST_TABLE
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import open_regular
from flexcal.jobs.guidance.measured_rows import split_line
from flexcal.jobs.guidance.row_cells import RowReader
from flexcal.model.robot import RobotModel


class ReadingGoesOn(InputError):
    """A file that was written anew, or a line that is left out: what follows can be read."""


class FollowedFile:
    """Reads the rows that were appended to a CSV file since the last time, complete lines only.

    Parameters
    ----------
    path : Path
        The file, which need not be there yet.
    model : RobotModel
        Robot whose joints the columns name.
    end : int
        Bytes that were read before, as `end` was then.
    """

    def __init__(self, path: Path, model: RobotModel, end: int = 0) -> None:
        self.path, self.model = path, model
        self._start, self._columns = 0, tuple[str, ...]()
        self._skipped = end

    @property
    def end(self) -> int:
        """Bytes up to the end of the last line that was read."""
        return max(self._start, self._skipped)

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the header; none before it is complete."""
        return self._columns

    def new_rows(self, *, is_whole: bool = False) -> list[dict[str, str]]:
        """Rows, texts by column, of the lines that are complete now and were not before; none where there is no file.

        Of a file that `is_whole` the last line is complete without an end of line.

        Raises `InputError` for a header that names other columns, a line with more or fewer values, a file that has become shorter, and
        a line that went on after it was read.
        """
        try:
            with open_regular(self.path, limit=LARGEST_TABLE) as stream:
                size = stream.seek(0, 2)
                if size < self.end:
                    self._start, self._columns, self._skipped = 0, (), 0
                    raise ReadingGoesOn(
                        "E-STUDIO-016",
                        f"{self.path} has become shorter: another program wrote it anew; the rows that it has now are read from its start.",
                    )
                if self.end and size > self.end:
                    self._require_line_ended(stream)
                stream.seek(self._start)
                content = stream.read()
        except FileNotFoundError:
            return []
        except OSError as problem:
            raise unreadable(self.path, problem) from problem
        rows: list[dict[str, str]] = []
        if not is_whole:
            content = content[: content.rfind(b"\n") + 1]
        for raw in content.splitlines(keepends=True):
            line = raw.decode("utf-8", "replace").lstrip("\ufeff").strip()
            cells = [] if not line or line.startswith("#") else split_line(line)
            if cells and not self._columns:
                RowReader(self.path, tuple(cells), self.model)
                self._columns = tuple(cells)
            elif cells and self._start < self._skipped:
                pass
            elif cells and len(cells) == len(self._columns):
                rows.append(dict(zip(self._columns, cells, strict=True)))
            elif cells and rows:
                return rows  # what is wrong with this line is said at the next call
            self._start += len(raw)
            if cells and len(cells) != len(self._columns) and self._start > self._skipped:
                raise ReadingGoesOn(
                    "E-STUDIO-017",
                    f"{self.path}: the line '{line[:60]}' has {len(cells)} values, but the header names {len(self._columns)} columns; it "
                    "is left out.",
                )
        return rows

    def _require_line_ended(self, stream: BinaryIO) -> None:
        """Raise `ReadingGoesOn` where the last line that was read, without an end of line, has gone on; the rest of it is passed over."""
        end = self.end
        stream.seek(end - 1)
        if any(byte in b"\r\n" for byte in stream.read(2)):
            return
        stream.seek(end)
        rest = stream.readline()
        if self._start == end:
            self._start += len(rest)
        self._skipped = end + len(rest)
        raise ReadingGoesOn(
            "E-STUDIO-051",
            f"{self.path}: the other program left its last line for so long that it was taken as complete, and has now written "
            f"'{rest.decode('utf-8', 'replace').strip()[:60]}' behind it; "
            "the row of that line is wrong: exclude it, and measure its pose again.",
        )
