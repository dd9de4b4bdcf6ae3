"""Strict reading of tables, CSV or Parquet: every cell must be present and finite."""

from __future__ import annotations

import csv
import io
import os
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import BufferedReader
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexcal.data.tables.parquet_sizes import require_decodable
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import (
    MEGABYTE,
    atomic_path,
    open_regular,
    regular_path,
    size_text,
)
from flexcal.printable import excerpt
from flexcal.units import LARGEST

if TYPE_CHECKING:
    import polars as pl

LARGEST_TABLE = 1000 * MEGABYTE
"""Bytes of a CSV file that is read whole."""
_LARGEST_TEXTS = 256 * MEGABYTE
_LONGEST_LINE = 16 * MEGABYTE
MOST_COLUMNS = 5000
_SHOWN = 4
"""Largest number of a folder's tables that are named."""
BLOCK_BYTES = 64 * 2**20
_DECODED = 100_000
"""Rows of Parquet that are decoded together: to slice some, all of their row group is."""
_PEEKED = 2**16
"""Bytes of a table that are read, for every line of its header, to see which columns hold texts."""
_SMALL = 300_000
"""Bytes of CSV that are read cell by cell sooner than Polars is imported."""
MOST_ROWS = 4_000_000
"""Largest number of rows of a table that is read whole."""
_QUOTED = 20
"""Largest number of characters of a number that a message quotes."""


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of a file: numbers as float64 arrays (N,), texts as arrays (N,) of `str`, by column.

    `first` is the number of the first row in the file; `number` (N,) are those of all rows, where some are left out.
    """

    file: TableFile
    first: int
    columns: Mapping[str, np.ndarray]
    number: np.ndarray | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def number_of(self, row: int) -> int:
        """Number in the file of a row of this table."""
        return int(self.first + row if self.number is None else self.number[row])

    def error(self, code: str, row: int, column: str | None, sentence: str) -> InputError:
        """An `InputError` that places `sentence` at a row (index in this table) and a column."""
        place = f"{self.file.path} {self.file.row_word} {self.number_of(row)}"
        return InputError(code, f"{place}{f', column {column}' if column else ''}: {sentence}")


@dataclass(frozen=True)
class TableFile:
    """Table whose header is read. `first` is the number of its first row: a line in CSV, else counted from 1; columns that are `unread` may
    hold anything, and rows that are `skipped`, counted from 0, are checked and not returned by `read`.
    """

    path: Path
    columns: tuple[str, ...]
    first: int
    unread: tuple[str, ...] = ()
    skipped: tuple[int, ...] = ()

    @property
    def row_word(self) -> str:
        return "line" if self.path.suffix == ".csv" else "row"

    def leaving_out(self, columns: Collection[str]) -> TableFile:
        """The same table without reading these columns either."""
        return replace(self, unread=(*self.unread, *columns))

    def skipping(self, rows: Collection[int]) -> TableFile:
        """The same table without these rows, counted from 0."""
        return replace(self, skipped=tuple(rows))

    def texts(self, column: str) -> list[str]:
        """All cells of one column as text; empty where there is nothing. Raises `InputError` as `read` does."""
        self._require_few_rows()
        if self.path.suffix == ".csv":
            with _open(self.path, LARGEST_TABLE) as stream:
                lines = stream.read().rstrip().split(b"\n")[self.first - 1 :]
            place = self.columns.index(column)
            rows = [
                _row(self.path, number, _decoded(self.path, raw, number).strip("\r"))
                for number, raw in enumerate(lines, start=self.first)
                if raw.strip()
            ]
            return [row[place] if place < len(row) else "" for row in rows]
        import polars as pl

        require_decodable(self.path, [column], stream=False)
        series = pl.read_parquet(regular_path(self.path, limit=None), columns=[column])[column]
        texts = _texts(self.path, column, series.cast(pl.String))
        return [text.strip() for text in texts.tolist()]

    def text_columns(self) -> tuple[str, ...]:
        """Columns whose first cell that is not empty, in the first rows, is no number."""
        if self.path.suffix == ".csv":
            with _open(self.path) as stream:
                lines = []
                for line in _lines(self.path, stream):
                    lines.append(line)
                    if stream.tell() >= self.first * _PEEKED:
                        break
            rows = [
                _row(self.path, self.first, raw.decode("utf-8", "replace").strip())
                for raw in lines[self.first - 1 :]
                if raw.strip()
            ]
            filled = [
                next((row[k] for row in rows if k < len(row) and row[k]), "0")
                for k in range(len(self.columns))
            ]
            return tuple(n for n, cell in zip(self.columns, filled, strict=True) if not _is_number(cell))
        import polars as pl

        schema = pl.read_parquet_schema(regular_path(self.path, limit=None))
        return tuple(name for name in self.columns if schema[name] == pl.String)

    def error(self, code: str, sentence: str) -> InputError:
        """An `InputError` about the header."""
        place = f" line {self.first - 1}" if self.path.suffix == ".csv" else ""
        return InputError(code, f"{self.path}{place}: {sentence}")

    def read(self, texts: Collection[str] = ()) -> Table:
        """All rows; `texts` are the columns that hold names.

        Raises `InputError` with row and column of the first fault, and, before any is loaded, for more rows than `MOST_ROWS`.
        """
        self._require_few_rows()
        is_csv = self.path.suffix == ".csv"
        blocks = list(self._csv_blocks(texts, None) if is_csv else self._parquet_blocks(texts, None))
        if not blocks:
            raise self.error("E-TABLE-019", "the file has a header but no rows; add some.")
        table = Table(self, self.first, _joined([block.columns for block in blocks]))
        if not self.skipped:
            return table
        kept = np.delete(np.arange(len(table)), self.skipped)
        columns = {name: values[kept] for name, values in table.columns.items()}
        return Table(self, table.first, columns, table.first + kept)

    def blocks(self, texts: Collection[str] = (), rows: int = 1_000_000) -> Iterator[Table]:
        """The rows in blocks of about this many, in order; raises `InputError` as `read` does."""
        if self.path.suffix == ".csv":
            yield from self._csv_blocks(texts, rows)
        else:
            yield from self._parquet_blocks(texts, rows)

    def _require_few_rows(self) -> None:
        rows = self._rows()
        if rows > MOST_ROWS:
            every = -(-rows // MOST_ROWS)
            raise InputError(
                "E-TABLE-045",
                f"{self.path}: there are about {rows:.2g} rows, and a table that is read whole has at most {MOST_ROWS}; "
                f"keep one pose of {every} with all its rows, or of a log a part.",
            )

    def _rows(self) -> int:
        """Number of rows; of a CSV file of more than `MOST_ROWS` estimated from its size."""
        if self.path.suffix != ".csv":
            import polars as pl

            return pl.scan_parquet(regular_path(self.path, limit=None)).select(pl.len()).collect().item()
        counted, read, beginning = 1 - self.first, 0, b""
        with _open(self.path) as stream:
            while part := stream.read(2**20):
                counted, read = counted + part.count(b"\n"), read + len(part)
                beginning = beginning + part if b"\n" not in part else part[part.rindex(b"\n") :]
                _require_lines(self.path, beginning)
                if counted > MOST_ROWS:
                    return max(counted, counted * os.fstat(stream.fileno()).st_size // read)
        return counted

    def _csv_blocks(self, texts: Collection[str], rows: int | None) -> Iterator[Table]:
        line = self.first
        with _open(self.path, LARGEST_TABLE if rows is None else None) as stream:
            for _ in range(self.first - 1):
                stream.readline()
            size = BLOCK_BYTES if rows is None else max(1, min(BLOCK_BYTES, rows * 12 * len(self.columns)))
            for content in _whole_lines(self.path, stream, size):
                table = Table(self, line, _parse(self, content, texts, line))
                yield table
                line += len(table)

    def _parquet_blocks(self, texts: Collection[str], rows: int | None) -> Iterator[Table]:
        import polars as pl

        unread = set(self.unread)
        read = [column for column in self.columns if column not in unread]
        require_decodable(self.path, set(read), stream=rows is not None)
        scan = pl.scan_parquet(regular_path(self.path, limit=None))
        try:
            schema = scan.collect_schema()
            for column in read:
                if column not in texts and not schema[column].is_numeric():
                    raise self.error(
                        "E-TABLE-020",
                        f"the column '{column}' holds {schema[column]}, not numbers; convert it.",
                    )
            scan = scan.select([pl.col(c).cast(pl.String if c in texts else pl.Float64) for c in read])
            start = 0
            while True:
                decoded = scan if rows is None else scan.slice(start, max(1, _DECODED // rows) * rows)
                frames = decoded.collect()
                if not len(frames):
                    return
                for frame in frames.iter_slices(rows or len(frames)):
                    table = Table(self, 1 + start, _arrays(self.path, frame))
                    _check_finite(table, frame)
                    yield table
                    start += len(frame)
                if rows is None:
                    return
        except pl.exceptions.PolarsError as problem:
            raise InputError(
                "E-TABLE-021",
                f"{self.path}: not a readable Parquet file ({_one_line(problem)}); export it again.",
            ) from problem


def open_table(path: str | Path) -> TableFile:
    """Read the header of a `.csv` (lines that start with # may precede it) or `.parquet` file.

    Raises `InputError` where the file cannot be read, has no header, or names a column twice.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError("E-TABLE-022", f"{path} is a folder; name a table{tables_in(path)}.")
    if path.suffix not in (".csv", ".parquet"):
        raise InputError(
            "E-TABLE-023", f"{path}: a table must end in .csv or .parquet; convert it or rename it."
        )
    with _open(path) as stream:
        if path.suffix == ".csv":
            columns, first = _csv_header(path, stream)
            file = TableFile(path, columns, first)
        else:
            file = TableFile(path, _parquet_columns(path), 1)
    if len(file.columns) > MOST_COLUMNS:
        raise file.error(
            "E-TABLE-050",
            f"there are {len(file.columns)} columns, and a table has up to {MOST_COLUMNS}; check that it is the right file.",
        )
    twice = next((name for name, count in Counter(file.columns).items() if count > 1), None)
    if twice is not None:
        raise file.error("E-TABLE-024", f"the column '{excerpt(twice)}' stands twice; rename or remove one.")
    return file


def write_table(path: str | Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write columns (N,) as CSV or Parquet by the file's suffix, atomically; numbers come back bit by bit."""
    import polars as pl

    write_frame(Path(path), pl.DataFrame({name: pl.Series(values) for name, values in columns.items()}))


def require_table(path: Path) -> None:
    """Raise `InputError` for a file to be written that is no table by its suffix."""
    if path.suffix not in (".csv", ".parquet"):
        raise InputError("E-TABLE-025", f"{path}: a table must end in .csv or .parquet; give another name.")


def write_frame(path: Path, frame: pl.DataFrame) -> None:
    """As `write_table`, of a frame of Polars."""
    require_table(path)
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        if path.suffix == ".csv":
            frame.write_csv(stream)
        else:
            frame.write_parquet(stream)


def tables_in(folder: Path) -> str:
    """Names of the tables in a folder, for a message; a few of them."""
    try:
        tables = [file for file in folder.iterdir() if file.suffix in (".csv", ".parquet")]
    except OSError:
        tables = []
    shown_names = [str(file) for file in sorted(tables, key=lambda file: (file.stem != "poses", file.name))]
    if not shown_names:
        return "; there is none in it"
    if len(shown_names) == 1:
        return f" in it, {shown_names[0]}"
    shown = ", ".join(shown_names[:_SHOWN]) + (
        f" and {len(shown_names) - _SHOWN} others" if len(shown_names) > _SHOWN else ""
    )
    return f" in it: {shown}"


def _open(path: Path, limit: int | None = None) -> BufferedReader:
    try:
        return open_regular(path, limit=limit)
    except OSError as problem:
        raise unreadable(path, problem) from problem


def _parquet_columns(path: Path) -> tuple[str, ...]:
    import polars as pl

    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(
            "E-TABLE-026", f"{path}: the path of a Parquet file must be UTF-8; rename what is not."
        ) from None
    try:
        return tuple(pl.read_parquet_schema(regular_path(path, limit=None)))
    except (pl.exceptions.PolarsError, OSError) as problem:
        raise InputError(
            "E-TABLE-027", f"{path}: not a readable Parquet file ({_one_line(problem)}); export it again."
        ) from problem


def _csv_header(path: Path, stream: BufferedReader) -> tuple[tuple[str, ...], int]:
    for number, raw in enumerate(_lines(path, stream), start=1):
        text = _decoded(path, raw, number).lstrip("\ufeff").strip()
        if not text or text.startswith("#"):
            continue
        if "\r" in text:
            raise InputError(
                "E-TABLE-028",
                f"{path} line {number}: lines end with CR alone; save the file with other line ends, or let 'flexcal import' read it.",
            )
        names = tuple(_row(path, number, text))
        if len(names) == 1 and any(mark in text for mark in ";\t"):
            raise InputError(
                "E-TABLE-029",
                f"{path} line {number}: the columns are not separated by commas; save it with commas, or let 'flexcal import' read it.",
            )
        if all(_is_number(name) for name in names):
            raise InputError(
                "E-TABLE-030",
                f"{path} line {number}: the header with the names of the columns is missing; add it.",
            )
        if "" in names:
            raise InputError(
                "E-TABLE-031",
                f"{path} line {number}: column {names.index('') + 1} has no name; name or remove it.",
            )
        return names, number + 1
    raise InputError("E-TABLE-032", f"{path} line 1: the file is empty; it needs a header and rows.")


def _decoded(path: Path, raw: bytes, line: int) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as problem:
        raise InputError(
            "E-TABLE-033",
            f"{path} line {line}: not UTF-8 text; save the file as UTF-8, or let 'flexcal import' read it.",
        ) from problem


def _lines(path: Path, stream: BufferedReader) -> Iterator[bytes]:
    """Lines of a stream, of bounded length."""
    while line := stream.readline(_LONGEST_LINE + 1):
        _require_lines(path, line)
        yield line


def _require_lines(path: Path, beginning: bytes) -> None:
    if len(beginning) > _LONGEST_LINE:
        raise InputError(
            "E-TABLE-048",
            f"{path} has a line of more than {size_text(_LONGEST_LINE)}, so it is no table; check that it is the right file.",
        )


def _whole_lines(path: Path, stream: BufferedReader, size: int) -> Iterator[bytes]:
    """The rest of the stream in parts that end with a line; blank lines at its very end are left out."""
    rest = b""
    while content := stream.read(size):
        cut = content.rfind(b"\n") + 1
        part, rest = rest + content[:cut], content[cut:] if cut else rest + content
        kept = part.rstrip(b"\r\n \t") if cut else b""
        if kept:
            # blank lines at the end of a part wait for what follows them
            end = part.find(b"\n", len(kept)) + 1
            yield part[:end]
            rest = part[end:] + rest
        elif cut:
            rest = part + rest
        _require_lines(path, rest)
    if last := rest.rstrip():
        yield last


def _parse(file: TableFile, content: bytes, texts: Collection[str], line: int) -> dict[str, np.ndarray]:
    """Columns of whole lines; where they are not numbers, a half at a time, until a small part can be read cell by cell."""
    if len(content) < _SMALL:
        return _read_cells(file, content, texts, line)
    import polars as pl

    unmeasured = {*texts, *file.unread}
    schema = {name: pl.String if name in unmeasured else pl.Float64 for name in file.columns}
    try:
        frame = pl.read_csv(io.BytesIO(content), has_header=False, schema=schema).drop(file.unread)
    except pl.exceptions.PolarsError:
        frame = None
    if frame is not None and not any(series.null_count() for series in frame.get_columns()):
        arrays = _arrays(file.path, frame)
        if all(name in unmeasured or _measurable(values).all() for name, values in arrays.items()):
            return arrays
    half = content.find(b"\n", len(content) // 2) + 1
    if not 0 < half < len(content):
        return _read_cells(file, content, texts, line)
    first = _parse(file, content[:half], texts, line)
    return _joined([first, _parse(file, content[half:], texts, line + content.count(b"\n", 0, half))])


def _joined(parts: Sequence[Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Columns of consecutive parts, joined."""
    if len(parts) == 1:
        return dict(parts[0])
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _arrays(path: Path, frame: pl.DataFrame) -> dict[str, np.ndarray]:
    return {
        name: frame[name].to_numpy() if frame[name].dtype.is_numeric() else _texts(path, name, frame[name])
        for name in frame.columns
    }


def _texts(path: Path, name: str, series: pl.Series) -> np.ndarray:
    """Texts (N,), empty where there is none."""
    longest = series.str.len_bytes().max()
    _require_short(path, name, len(series), longest if isinstance(longest, int) else 0)
    return np.array([value or "" for value in series.to_list()], dtype=str)


def _require_short(path: Path, name: str, rows: int, longest: int) -> None:
    """NumPy's texts all take the place of the longest."""
    if 4 * rows * longest > _LARGEST_TEXTS:
        raise InputError(
            "E-TABLE-049",
            f"{path}, column {excerpt(name)}: {rows} texts of up to {longest} characters exceed {size_text(_LARGEST_TEXTS)}; shorten them.",
        )


def _read_cells(file: TableFile, content: bytes, texts: Collection[str], line: int) -> dict[str, np.ndarray]:
    """Read cell by cell, which tells where the first fault is; raises `InputError` there."""
    unread = set(file.unread)
    cells: dict[str, list[Any]] = {name: [] for name in file.columns}
    for number, raw in enumerate(content.split(b"\n"), start=line):
        text = _decoded(file.path, raw, number).strip("\r")
        if not text and number == line + content.count(b"\n"):
            break
        if not text.strip():
            raise InputError("E-TABLE-034", f"{file.path} line {number}: the line is empty; remove it.")
        row = _row(file.path, number, text)
        if len(row) != len(file.columns):
            raise InputError(
                "E-TABLE-035",
                f"{file.path} line {number}: there are {len(row)} values, but the header names {len(file.columns)} columns; "
                "complete the line or remove it.",
            )
        for name, cell in zip(file.columns, row, strict=True):
            fault = None if name in unread else _fault(cell, name in texts)
            if fault:
                raise InputError("E-TABLE-036", f"{file.path} line {number}, column {name}: {fault}")
            cells[name].append(cell if name in texts or name in unread else float(cell))
    for name in cells.keys() & set(texts):
        _require_short(file.path, name, len(cells[name]), max(map(len, cells[name]), default=0))
    return {
        name: np.array(values, dtype=str if name in texts else np.float64)
        for name, values in cells.items()
        if name not in unread
    }


def _row(path: Path, line: int, text: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([text]))]
    except csv.Error as problem:
        raise InputError(
            "E-TABLE-037", f"{path} line {line}: the line cannot be read ({problem}); correct it."
        ) from problem


def _measurable(values: np.ndarray) -> np.ndarray:
    """Mask (N,) of numbers that can be measurements: finite, and below `LARGEST`."""
    return np.abs(values) <= LARGEST


def _fault(cell: str, is_text: bool) -> str | None:
    if not cell:
        return "the value is missing; complete or remove this line, and others like it."
    if is_text:
        return None
    if not _is_number(cell):
        comma = " with a decimal point" if _is_number(cell.replace(",", ".")) else ""
        return f"'{excerpt(cell)}' is not a number; write one{comma}."
    number = float(cell)
    if not abs(number) <= LARGEST:
        shown = cell if len(cell) < _QUOTED else f"{number:g}"
        return f"the value is {shown}, which is no measurement; remove this line, and others like it, or measure them again."
    return None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _check_finite(table: Table, frame: pl.DataFrame) -> None:
    for name, values in table.columns.items():
        if frame[name].null_count():
            raise table.error(
                "E-TABLE-038",
                int(np.argmax(frame[name].is_null().to_numpy())),
                name,
                "the value is missing; complete or remove this row, and others like it.",
            )
        if values.dtype.kind == "f" and not _measurable(values).all():
            row = int(np.argmin(_measurable(values)))
            raise table.error(
                "E-TABLE-039",
                row,
                name,
                f"the value is {values[row]}, which is no measurement; remove this row, and others like it, or measure them again.",
            )


def _one_line(problem: BaseException) -> str:
    return " ".join(str(problem).split())
