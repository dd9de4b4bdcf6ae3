"""Joint logs on disk: CSV or Parquet, whole or in blocks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.recordings.joint_log import Recording, RecordingLabel
from flexcal.data.recordings.sample_times import LATE, MOST_EQUAL
from flexcal.data.recordings.time_base import TimeBase, uniform_blocks
from flexcal.data.tables import (
    UNITS,
    Signal,
    Table,
    assign,
    check_joint_units,
    open_table,
    standard_columns,
    timestamp_columns,
    with_seconds,
    write_table,
)
from flexcal.errors import InputError
from flexcal.model.robot import sensor_column

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_FIELDS = {
    "q": "q",
    "tau": "torque",
    "qa": "arm",
    "qax": "tilt_x",
    "qay": "tilt_y",
    "dq": "velocity",
    "ddq": "acceleration",
    "dqa": "arm_velocity",
    "tau_ext": "external_torque",
    "force": "force",
    "moment": "moment",
    "temperature": "temperature",
    "payload": "payload",
}
FILL = 0.02
"""Longest time without samples, s, that interpolation may fill in a log of a robot's own motion, which lies below 10 Hz."""
_REQUIRED = ("t", "q", "tau")
_OPTIONAL = ("qa", "qax", "qay", "dq", "ddq", "dqa", "tau_ext", "force", "moment", "temperature", "payload")


def read_recording(
    path: str | Path, model: RobotModel, label: RecordingLabel | None = None, *, fill: float = 0.0
) -> Recording:
    """Read one joint log; where its time stamps jitter, values are interpolated onto a uniform time base.

    Parameters
    ----------
    path : str or Path
        The log.
    model : RobotModel
        Robot whose joints the log has; `signals:` of its robot.yaml says what the columns are, where they are not the usual ones.
    label : RecordingLabel, optional
        Pose, realisation, orthogonal experiment and sign, in a frequency experiment.
    fill : float
        Longest gap, s, that is interpolated; steps of up to 2.5 time steps always are.

    Returns
    -------
    Recording
        Joint positions and torques in SI units; its `time_base` says how the time stamps were.

    Raises
    ------
    InputError
        With file, line and column, for a missing, unknown or partial column, a value that is missing or no number, time that
        runs backwards by more than 50 ms or stands still, a gap (a step of more than 2.5 time steps and more than `fill`), a
        rate outside 1 Hz to 20 kHz, and angles that cannot be in rad.

    Examples
    --------
    >>> from flexcal import RobotModel, read_recording
    >>> model = RobotModel.from_yaml("examples/tx40/robot.yaml")
    >>> log = read_recording("examples/tx40/exciting.parquet", model)
    >>> log.q.shape
    (45000, 6)
    >>> print(f"{log.duration:.0f} s at {1 / log.time_step:.0f} Hz")
    9 s at 5000 Hz
    """
    file = open_table(path)
    signals = assign(file, model, _REQUIRED, (*_OPTIONAL, *_sensor_columns(model)))
    texts = timestamp_columns(signals)
    (table,) = with_seconds([file.read(texts)], texts)
    t = signals["t"].values(table)[:, 0]
    check_time(table, signals["t"], t, None)
    values = _stacked(model, table, signals)
    (base, whole), *others = uniform_blocks([(t, values)], positions=model.n, fill=fill)
    if others:
        later = others[0][0]
        several = f" (the first of {len(others)})" if len(others) > 1 else ""
        raise table.error(
            "E-LOG-011",
            int(np.argmax(t > later.start - 0.5 * later.time_step)),
            signals["t"].columns[0],
            f"a gap of {later.gap:.6g} s{several} precedes this sample, where {base.time_step:.6g} s is usual; "
            "record again, or cut the log there into two files.",
        )
    return _recording(path, signals, whole, base, label, model)


def read_recording_blocks(
    path: str | Path, model: RobotModel, *, rows: int = 1_000_000, label: RecordingLabel | None = None
) -> Iterator[Recording]:
    """Read a joint log of any length in constant memory, as recordings of about `rows` samples that follow each other.

    All have one time step, that of the first block. A block continues the one before without a seam, except after a
    gap in the log: its `time_base.gap` then says how many seconds are missing. Steps of up to 20 ms are no gaps. Raises `InputError` as
    `read_recording` does, except for gaps.
    """
    file = open_table(path)
    signals = assign(file, model, _REQUIRED, (*_OPTIONAL, *_sensor_columns(model)))
    empty = True
    texts = timestamp_columns(signals)
    stamped = _stamped(model, signals, with_seconds(file.blocks(texts, rows), texts))
    for base, values in uniform_blocks(stamped, positions=model.n, fill=FILL):
        empty = False
        yield _recording(path, signals, values, base, label, model)
    if empty:
        raise file.error("E-LOG-012", "the file has a header but no rows; add some.")


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
                "E-LOG-013",
                f"{path}: {field} of the recording holds a value that is not finite, so it is not written.",
            )
        names = standard_columns(quantity, recording.q.shape[1])
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    columns |= {
        sensor_column(name): recording.sensor_readings[:, k] for k, name in enumerate(recording.sensors)
    }
    write_table(path, columns)


def _sensor_columns(model: RobotModel) -> dict[str, str]:
    """Column and name of every sensor on the arm that robot.yaml declares."""
    return {sensor.column: name for name, sensor in model.sensors.items()}


def _stamped(
    model: RobotModel, signals: dict[str, Signal], tables: Iterator[Table]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Time stamps and all other quantities, block by block, checked as a whole log is."""
    before: float | None = None
    payload: float | None = None
    for table in tables:
        t = signals["t"].values(table)[:, 0]
        check_time(table, signals["t"], t, before)
        before = float(t.max()) if before is None else max(before, float(t.max()))
        yield t, _stacked(model, table, signals, payload)
        payload = float(signals["payload"].values(table)[0, 0]) if "payload" in signals else None


def _stacked(
    model: RobotModel, table: Table, signals: dict[str, Signal], payload: float | None = None
) -> np.ndarray:
    """All quantities but the time side by side (N, ·), in the order of `signals`; `payload` is that of the rows before, kg."""
    parts = []
    for quantity, signal in signals.items():
        if quantity == "t":
            continue
        values = signal.values(table)
        if quantity in ("q", "qa"):
            check_joint_units(model, table, signal, values)
        if quantity == "payload":
            _check_payload(model, table, signal, values[:, 0], payload)
        parts.append(values)
    return np.concatenate(parts, axis=1)


def _check_payload(
    model: RobotModel, table: Table, signal: Signal, payload: np.ndarray, before: float | None
) -> None:
    if model.payload is None:
        raise table.file.error(
            "E-LOG-014",
            "there is a column 'payload', but robot.yaml declares none; add `payload:` with the frame to which it is attached.",
        )
    first = payload[0] if before is None else before
    wrong = (payload < 0) | (payload != first)
    if wrong.any():
        row = int(np.argmax(wrong))
        sentence = (
            f"a payload of {payload[row]:g} kg; it must not be negative."
            if payload[row] < 0
            else f"{payload[row]:g} kg follow {first:g} kg; a log has one payload, so cut it there into two files."
        )
        raise table.error("E-LOG-015", row, signal.columns[0], sentence)


def _recording(
    path: str | Path,
    signals: dict[str, Signal],
    values: np.ndarray,
    base: TimeBase,
    label: RecordingLabel | None,
    model: RobotModel,
) -> Recording:
    fields: dict[str, np.ndarray] = {}
    sensors, sensed = _sensor_columns(model), {}
    column = 0
    for quantity in signals:
        if quantity == "t":
            continue
        width = len(standard_columns(quantity, model.n))
        part = values[:, column : column + width]
        column += width
        if quantity in sensors:
            sensed[sensors[quantity]] = part[:, 0]
            continue
        fields[_FIELDS[quantity]] = part[:, 0] if quantity in ("temperature", "payload") else part
    return Recording(
        time_step=base.time_step,
        start=base.start,
        label=label,
        time_base=base,
        file=Path(path),
        q=fields.pop("q"),
        torque=fields.pop("torque"),
        sensors=tuple(sensed),
        sensed=np.stack(list(sensed.values()), axis=1) if sensed else None,
        **fields,
    )


def check_time(table: Table, signal: Signal, t: np.ndarray, before: float | None) -> None:
    """Check the time stamps `t` (N,) that follow one at `before` (None: they begin the log)."""
    if before is None and len(t) < 2:
        raise table.error("E-LOG-016", 0, None, "this is the only sample; a log needs at least two.")
    latest = np.maximum.accumulate(t if before is None else np.maximum(t, before))
    if (latest - t > LATE).any():
        row = int(np.argmax(latest - t > LATE))
        raise table.error(
            "E-LOG-017",
            row,
            signal.columns[0],
            f"the time runs backwards: {t[row]:.9g} s follows {latest[row]:.9g} s; sort or repair the log, or cut it there into two "
            "files.",
        )
    changes = np.concatenate([[0], np.flatnonzero(np.diff(t)) + 1, [len(t)]])
    equal = np.diff(changes)
    if equal.max() > MOST_EQUAL or (before is None and len(equal) < 2):
        run = int(np.argmax(equal))
        raise table.error(
            "E-LOG-018",
            int(changes[run]) + 1,
            signal.columns[0],
            f"the time stands still: {equal[run]} rows have {t[changes[run]]:.9g} s; write the time with more digits, or repair the log.",
        )
    if before is None:
        steps = np.diff(t)
        _check_rate(table, signal, float(np.median(steps[steps > 0])))


def _check_rate(table: Table, signal: Signal, step: float) -> None:
    if 1 / 22_000 <= step <= 1.1:
        return
    unit = next((unit for unit in ("ms", "us") if 1 / 22_000 <= step * UNITS["t"][unit] <= 1.1), None)
    guess = (
        f"if it is in {unit}, declare 'unit: {unit}' for t under `signals:`." if unit else "check its unit."
    )
    raise table.error(
        "E-LOG-019", 0, signal.columns[0], f"one sample every {step:.6g} s is outside 1 Hz to 20 kHz; {guess}"
    )
