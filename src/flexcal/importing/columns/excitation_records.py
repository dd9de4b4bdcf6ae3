"""Records of an excited axis from files of other programs, on a uniform time base, divided at gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flexcal.data.recordings import LATE, TimeSummary, uniform_blocks
from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError
from flexcal.frequency.arbitrary import SHORTEST, Channel, ExcitationRecord
from flexcal.importing.columns.excitation_columns import ResponseColumns, response_columns
from flexcal.importing.columns.unit_inference import time_unit
from flexcal.importing.readers import read_foreign
from flexcal.importing.tables import ForeignTable, parse_name
from flexcal.units import LARGEST

ExcitationSource = Path | Mapping[str, np.ndarray]
"""Record of an excitation: a file, or columns (N,) by name."""
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


@dataclass(frozen=True, eq=False)
class ResponseRecords:
    """Records with the channels of their columns, and what was done to read them, a sentence each.

    `guessed` tells that the references were recognised, not named.
    """

    records: tuple[ExcitationRecord, ...]
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    references: tuple[Channel, ...]
    remarks: tuple[str, ...]
    guessed: bool = False

    def without_references(self, remark: str = "") -> ResponseRecords:
        """The same of inputs and outputs alone, and why."""
        records = tuple(replace(record, references=record.references[:, :0]) for record in self.records)
        remarks = (*self.remarks, remark) if remark else self.remarks
        return replace(self, records=records, references=(), remarks=remarks, guessed=False)


def read_response_records(
    sources: Sequence[ExcitationSource],
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    references: Sequence[str] = (),
    rate_hz: float | None = None,
) -> ResponseRecords:
    """Records of one experiment from files, or from columns in memory; the columns are those of the first.

    `rate_hz` is the sampling rate of files without a column of time. Raises `InputError` where a file lacks a column, holds a cell that is
    no number, a constant input or output, or a time that does not grow.
    """
    files = record_paths(sources)
    tables = [
        read_foreign(source, ()) if isinstance(source, Path) else _table(file, source)
        for file, source in zip(files, sources, strict=True)
    ]
    columns = response_columns(tables[0], inputs=inputs, outputs=outputs, references=references)
    if columns.guessed and not all(_is_whole(table, columns) for table in tables):
        columns = replace(columns, references=(), guessed=False)
    records: list[ExcitationRecord] = []
    remarks = list(columns.remarks)
    for file, table in zip(files, tables, strict=True):
        of_file, notes = _records(file, table, columns, rate_hz)
        records += of_file
        remarks += notes
    for side, chosen in (("inputs", columns.inputs), ("outputs", columns.outputs)):
        signals = np.concatenate([getattr(record, side) for record in records])
        for column, varies in zip(chosen, np.ptp(signals, axis=0) > 0, strict=True):
            if not varies:
                raise InputError(
                    "E-IMPORT-077",
                    f"{files[0]}: the column '{column.channel.name}' is constant, so it tells no response; name another (--input, "
                    "--output), or record it.",
                )
    step = float(np.median([record.time_step for record in records]))
    near = [abs(record.time_step / step - 1) < 1e-3 for record in records]
    if all(near):
        records = [replace(record, time_step=step) for record in records]
    return ResponseRecords(
        tuple(records),
        tuple(c.channel for c in columns.inputs),
        tuple(c.channel for c in columns.outputs),
        tuple(c.channel for c in columns.references),
        _merged(remarks, len(files)),
        columns.guessed,
    )


def record_paths(sources: Sequence[ExcitationSource]) -> tuple[Path, ...]:
    """The files, and in place of columns in memory their names, "record 1" and so on."""
    return tuple(
        source if isinstance(source, Path) else Path(f"record {number}")
        for number, source in enumerate(sources, start=1)
    )


def _table(name: Path, columns: Mapping[str, np.ndarray]) -> ForeignTable:
    values = {key: np.asarray(column, dtype=float) for key, column in columns.items()}
    lengths = {len(column) if column.ndim == 1 else -1 for column in values.values()}
    if len(lengths) != 1 or min(lengths) < 1:
        raise InputError(
            "E-IMPORT-056",
            f"{name}: columns of a record have one number a sample, and all are of one length.",
        )
    return ForeignTable(Table(TableFile(name, tuple(values), 1), 1, values))


def _is_whole(table: ForeignTable, columns: ResponseColumns) -> bool:
    """Whether a file has all references, without a hole."""
    names = [column.channel.name for column in columns.references]
    return all(name in table.numbers and bool(np.isfinite(table.numbers[name]).all()) for name in names)


def _merged(remarks: Sequence[str], files: int) -> tuple[str, ...]:
    """Each once, however many files it is said of."""
    counted: dict[str, int] = {}
    for remark in remarks:
        counted[remark] = counted.get(remark, 0) + 1
    return tuple(
        f"{text} (in {n} of {files} files)" if n > 1 and n != files else text for text, n in counted.items()
    )


def _records(
    file: Path, table: ForeignTable, columns: ResponseColumns, rate_hz: float | None
) -> tuple[list[ExcitationRecord], list[str]]:
    notes: list[str] = []
    of = (*columns.inputs, *columns.outputs, *columns.references)
    for column in of:
        _check(file, table, column.channel.name)
    values = np.stack([column.values(table) for column in of], -1)
    t, note = _times(file, table, columns.time, rate_hz)
    notes += [note] if note else []
    number = np.arange(len(of)) - len(columns.inputs)
    is_position = np.array(
        [0 <= k < len(columns.outputs) and columns.outputs[k].channel.derivative == 0 for k in number]
    )
    order = np.argsort(~is_position, kind="stable")
    summary, records = TimeSummary(), []
    for base, ordered in uniform_blocks([(t, values[:, order])], positions=int(is_position.sum())):
        if len(ordered) < SHORTEST:
            summary.short += len(ordered) * base.time_step
            continue
        summary.add(base)
        records.append(_record(file.name, base.time_step, ordered[:, np.argsort(order)], columns))
    if not records:
        raise InputError(
            "E-IMPORT-006", f"{file}: no stretch without a gap has {SHORTEST} samples; record longer."
        )
    if summary.sentence:
        notes.append(f"{summary.sentence} ({file.name})")
    return records, notes


def _record(name: str, step: float, values: np.ndarray, columns: ResponseColumns) -> ExcitationRecord:
    n_u, n_y = len(columns.inputs), len(columns.outputs)
    return ExcitationRecord(name, step, values[:, :n_u], values[:, n_u : n_u + n_y], values[:, n_u + n_y :])


def _check(file: Path, table: ForeignTable, column: str) -> None:
    if column not in table.numbers:
        raise InputError(
            "E-IMPORT-007",
            f"{file}: there is no column of numbers '{column}', which the first file has; give files of one experiment.",
        )
    numbers = table.numbers[column]
    wrong = np.flatnonzero(~(np.abs(numbers) <= LARGEST))
    if wrong.size:
        row = int(wrong[0])
        what = f"the value is {numbers[row]:g}, which is no measurement"
        if np.isnan(numbers[row]):
            what = "there is no number"
        raise table.table.error("E-IMPORT-008", row, column, f"{what}; complete the cell or remove the row.")


def _times(
    file: Path, table: ForeignTable, column: str | None, rate_hz: float | None
) -> tuple[np.ndarray, str]:
    if column is None or rate_hz is not None:
        if rate_hz is None:
            raise InputError(
                "E-IMPORT-009",
                f"{file}: no column of time was recognised; name it 't', or give the sampling rate with --rate HZ.",
            )
        return np.arange(len(table)) / rate_hz, ""
    _check(file, table, column)
    raw = table.numbers[column]
    unit = parse_name(column, table.units.get(column)).unit
    known = column in table.times or unit in _SECONDS
    unit = "s" if column in table.times else unit if unit in _SECONDS else time_unit(raw)
    seconds = (raw - raw[0]) * _SECONDS[unit]
    back = np.flatnonzero(np.diff(seconds) < -LATE)
    if back.size:
        raise table.table.error(
            "E-IMPORT-010",
            int(back[0]) + 1,
            column,
            "the time runs backwards; remove the row, or give the rate of uniform samples with --rate HZ.",
        )
    if not seconds[-1] > 0:
        raise table.table.error(
            "E-IMPORT-011",
            0,
            column,
            "the time stands still; give the rate of uniform samples with --rate HZ.",
        )
    return seconds, "" if known or unit == "s" else f"{column} is taken to be in {unit}"
