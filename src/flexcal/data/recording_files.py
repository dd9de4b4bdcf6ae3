"""Joint logs on disk: CSV or Parquet, whole or in blocks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.joint_limits import check_joint_units
from flexcal.data.recording import Recording, RecordingLabel
from flexcal.data.signals import UNITS, Signal, assign, standard_columns
from flexcal.data.table import Table, open_table, write_table
from flexcal.data.time_base import TimeBase, fit_time_base, gaps, resample, uniform_blocks
from flexcal.errors import InputError

if TYPE_CHECKING:
    from flexcal.model import RobotModel

_FIELDS = {
    "q": "q",
    "tau": "torque",
    "qa": "arm",
    "dq": "velocity",
    "ddq": "acceleration",
    "dqa": "arm_velocity",
    "tau_ext": "external_torque",
    "force": "force",
    "moment": "moment",
    "temperature": "temperature",
    "payload": "payload",
}
_REQUIRED = ("t", "q", "tau")
_OPTIONAL = ("qa", "dq", "ddq", "dqa", "tau_ext", "force", "moment", "temperature", "payload")


def read_recording(path: str | Path, model: RobotModel, label: RecordingLabel | None = None) -> Recording:
    """Read one joint log; where its time stamps jitter, values are interpolated onto a uniform base.

    Raises `InputError` with file, line and column for a missing, unknown or partial column, a value that is missing or
    no number, time that does not increase, a gap (more than two samples missing), a rate outside 1 Hz to 20 kHz, and
    angles that cannot be in rad. `recording.time_base` says how regular the time stamps were.
    """
    file = open_table(path)
    signals = assign(file, model, _REQUIRED, _OPTIONAL)
    table = file.read()
    t = signals["t"].values(table)[:, 0]
    _check_increasing(table, signals["t"], t, None)
    if len(t) < 2:
        raise table.error(0, None, "this is the only sample; a log needs at least two.")
    holes = gaps(t)
    if holes.size:
        row = int(holes[0])
        step = float(np.median(np.diff(t)))
        others = f" (the first of {holes.size})" if holes.size > 1 else ""
        raise table.error(
            row + 1,
            signals["t"].columns[0],
            f"a gap of {t[row + 1] - t[row]:.6g} s{others} precedes this sample, where {step:.6g} s is usual; "
            "record again, or cut the log there into two files.",
        )
    base = fit_time_base(t)
    _check_rate(table, signals["t"], base.time_step)
    values = _stacked(model, table, signals)
    return _recording(path, signals, resample(t, values, base), base, label, model.n)


def read_recording_blocks(
    path: str | Path, model: RobotModel, *, rows: int = 1_000_000, label: RecordingLabel | None = None
) -> Iterator[Recording]:
    """Read a joint log of any length in constant memory, as recordings of about `rows` samples that follow each other.

    All have one time step, that of the first block. A block continues the one before without a seam, except after a
    gap in the log: its `time_base.gap` then says how many seconds are missing. Raises `InputError` as `read_recording`
    does, except for gaps.
    """
    file = open_table(path)
    signals = assign(file, model, _REQUIRED, _OPTIONAL)
    empty = True
    for base, values in uniform_blocks(_stamped(model, signals, file.blocks((), rows))):
        empty = False
        yield _recording(path, signals, values, base, label, model.n)
    if empty:
        raise file.error("the file has a header but no rows; add some.")


def write_recording(path: str | Path, recording: Recording) -> None:
    """Write a joint log as CSV or Parquet by the file's suffix, atomically, under the standard columns in SI units.

    Raises `InputError` where a value is not finite.
    """
    columns: dict[str, np.ndarray] = {"t": recording.time}
    for quantity, field in _FIELDS.items():
        values = getattr(recording, field)
        if values is None:
            continue
        values = values.reshape(len(recording), -1)
        if not np.isfinite(values).all():
            raise InputError(
                f"{path}: {field} of the recording holds a value that is not finite, so it is not written."
            )
        names = standard_columns(quantity, recording.q.shape[1])
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    write_table(path, columns)


def _stamped(
    model: RobotModel, signals: dict[str, Signal], tables: Iterator[Table]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Time stamps and all other quantities, block by block, checked as a whole log is."""
    before: float | None = None
    held: float | None = None
    for table in tables:
        t = signals["t"].values(table)[:, 0]
        _check_increasing(table, signals["t"], t, before)
        if before is None:
            if len(t) < 2:
                raise table.error(0, None, "this is the only sample; a log needs at least two.")
            _check_rate(table, signals["t"], float(np.median(np.diff(t))))
        before = float(t[-1])
        yield t, _stacked(model, table, signals, held)
        held = float(signals["payload"].values(table)[0, 0]) if "payload" in signals else None


def _stacked(
    model: RobotModel, table: Table, signals: dict[str, Signal], held: float | None = None
) -> np.ndarray:
    """All quantities but the time side by side (N, ·), in the order of `signals`; `held` is the payload of the rows before, kg."""
    parts = []
    for quantity, signal in signals.items():
        if quantity == "t":
            continue
        values = signal.values(table)
        if quantity in ("q", "qa"):
            check_joint_units(model, table, signal, values)
        if quantity == "payload":
            _check_payload(model, table, signal, values[:, 0], held)
        parts.append(values)
    return np.concatenate(parts, axis=1)


def _check_payload(
    model: RobotModel, table: Table, signal: Signal, held: np.ndarray, before: float | None
) -> None:
    if model.payload is None:
        raise table.file.error(
            "there is a column 'payload', but robot.yaml declares none; add `payload:` with the frame to which it is attached."
        )
    first = held[0] if before is None else before
    wrong = (held < 0) | (held != first)
    if wrong.any():
        row = int(np.argmax(wrong))
        sentence = (
            f"a payload of {held[row]:g} kg; it must not be negative."
            if held[row] < 0
            else f"{held[row]:g} kg follow {first:g} kg; a log has one payload, so cut it there into two files."
        )
        raise table.error(row, signal.columns[0], sentence)


def _recording(
    path: str | Path,
    signals: dict[str, Signal],
    values: np.ndarray,
    base: TimeBase,
    label: RecordingLabel | None,
    n: int,
) -> Recording:
    fields: dict[str, np.ndarray] = {}
    column = 0
    for quantity in signals:
        if quantity == "t":
            continue
        width = len(standard_columns(quantity, n))
        part = values[:, column : column + width]
        fields[_FIELDS[quantity]] = part[:, 0] if quantity in ("temperature", "payload") else part
        column += width
    return Recording(
        time_step=base.time_step,
        start=base.start,
        label=label,
        time_base=base,
        file=Path(path),
        q=fields.pop("q"),
        torque=fields.pop("torque"),
        **fields,
    )


def _check_increasing(table: Table, signal: Signal, t: np.ndarray, before: float | None) -> None:
    first = t[:1] if before is None else np.array([before])
    steps = np.diff(t, prepend=first)
    steps[0] = steps[0] if before is not None else 1.0
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0))
        earlier = before if row == 0 else t[row - 1]
        what = "stands still" if steps[row] == 0 else "runs backwards"
        raise table.error(
            row,
            signal.columns[0],
            f"the time {what}: {t[row]:.9g} s follows {earlier:.9g} s; sort or repair the log.",
        )


def _check_rate(table: Table, signal: Signal, step: float) -> None:
    if 1 / 22_000 <= step <= 1.1:
        return
    unit = next((unit for unit in ("ms", "us") if 1 / 22_000 <= step * UNITS["t"][unit] <= 1.1), None)
    guess = (
        f"if it is in {unit}, declare 'unit: {unit}' for t under `signals:`." if unit else "check its unit."
    )
    raise table.error(
        0, signal.columns[0], f"one sample every {step:.6g} s is outside 1 Hz to 20 kHz; {guess}"
    )
