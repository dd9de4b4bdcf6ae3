"""Conversion of file columns to SI values at the joint: `signals:` of robot.yaml, or the standard names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables.tabular_file import Table, TableFile
from flexcal.errors import InputError, unreadable
from flexcal.files.formats import read_yaml_file
from flexcal.files.structuring import suggestion
from flexcal.files.transaction import MEGABYTE, read_text
from flexcal.printable import excerpt
from flexcal.units import COLDEST, DEGREE, HOTTEST, INCH, MILLIMETRE, temperature_fault

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel, SignalConfig

JOINT_QUANTITIES = ("q", "dq", "ddq", "tau", "qa", "qax", "qay", "dqa", "tau_ext", "qc", "approach")
"""Quantities with one column a joint, numbered from 1."""
VECTORS = {
    "xyz": ("x", "y", "z"),
    "quaternion": ("qw", "qx", "qy", "qz"),
    "sigma_xyz": ("sigma_x", "sigma_y", "sigma_z"),
    "base_xyz": ("base_x", "base_y", "base_z"),
    "base_quaternion": ("base_qw", "base_qx", "base_qy", "base_qz"),
    "work_xyz": ("wx", "wy", "wz"),
    "force": ("fx", "fy", "fz"),
    "moment": ("mx", "my", "mz"),
}
"""Quantities with several columns; every other quantity is a single column of its own name."""

_ANGLE = {"rad": 1.0, "deg": DEGREE, "turn": 2 * pi, "m": 1.0, "mm": MILLIMETRE}
_RATE = {"rad/s": 1.0, "deg/s": DEGREE, "rpm": 2 * pi / 60, "m/s": 1.0, "mm/s": MILLIMETRE}
_ACCELERATION = {"rad/s^2": 1.0, "deg/s^2": DEGREE, "m/s^2": 1.0, "mm/s^2": MILLIMETRE}
_TORQUE = {"N m": 1.0, "Nm": 1.0, "N": 1.0, "A": 1.0, "mA": 1e-3}
_TILT = {"rad": 1.0, "mrad": 1e-3, "deg": DEGREE, "1": 1.0, "m/s^2": 1 / 9.80665}
_LENGTH = {"m": 1.0, "mm": MILLIMETRE, "um": 1e-6, "cm": 1e-2, "in": INCH, "ft": 12 * INCH}
TIMESTAMP = "timestamp"
"""Unit of time for texts with date or time of day, which count as seconds from the first."""
UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0, "ms": 1e-3, "us": 1e-6, TIMESTAMP: 1.0},
    **dict.fromkeys(("q", "qa", "qax", "qay", "qc"), _ANGLE),
    **dict.fromkeys(("dq", "dqa"), _RATE),
    "ddq": _ACCELERATION,
    **dict.fromkeys(("tau", "tau_ext"), _TORQUE),
    **dict.fromkeys(("xyz", "length", "sigma", "sigma_xyz", "base_xyz"), _LENGTH),
    "force": {"N": 1.0, "kN": 1e3},
    "moment": {"N m": 1.0, "Nm": 1.0},
    "payload": {"kg": 1.0, "g": 1e-3},
    "quaternion": {},
    "approach": {},
    "base_quaternion": {},
    "sigma_angle": {"rad": 1.0, "deg": DEGREE},
    **dict.fromkeys(("tilt_x", "tilt_y", "tilt_z"), _TILT),
    "temperature": {"degC": 1.0, "degF": 5 / 9, "K": 1.0},
}
"""Quantities that `signals:` can map, and the factors of their units to SI; currents take a gain in N m/A."""

ZEROS = {"degF": -32.0, "K": -273.15}
"""What is added to a value in such a unit before the factor to SI, or to °C."""

SENSOR_UNITS: tuple[dict[str, float], ...] = (
    _LENGTH,
    {"m/s": 1.0, "mm/s": MILLIMETRE},
    {"m/s^2": 1.0, "mm/s^2": MILLIMETRE, "g": 9.80665},
)
"""Units of the readings of a sensor on the arm, by the time derivative that it measures."""


@dataclass(frozen=True, eq=False)
class Signal:
    """SI = matrix · (factor ⊙ columns) + offset for one quantity; (k,) columns become (m,) values.

    `column_of` names the column to blame for value i: its own where there is no matrix, else the first. `timestamps`: the columns are
    texts, which `with_seconds` turns into numbers first.
    """

    quantity: str
    columns: tuple[str, ...]
    factor: np.ndarray
    matrix: np.ndarray | None
    offset: np.ndarray
    timestamps: bool = False

    def values(self, table: Table) -> np.ndarray:
        """The quantity (N, m) in SI units, temperatures in °C; raises `InputError` at the first that no arm has."""
        values = np.stack([table.columns[name] for name in self.columns], axis=1)
        if self.matrix is not None or self.offset.any() or (self.factor != 1.0).any():
            scaled = values * self.factor
            values = (scaled if self.matrix is None else scaled @ self.matrix.T) + self.offset
        if self.quantity == "temperature":
            _check_celsius(table, self.columns[0], values[:, 0])
        return values

    def columns_of(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """The columns (N,) that a file would have for a quantity (N, m), by name; raises `InputError` where the matrix has no inverse."""
        raw = values - self.offset
        if self.matrix is not None:
            if self.matrix.shape[0] != self.matrix.shape[1] or np.linalg.cond(self.matrix) > 1e12:
                raise InputError(
                    "E-TABLE-003",
                    f"the matrix of signals.{self.quantity} has no inverse, so {', '.join(self.columns)} cannot be written; "
                    f"give the targets in {', '.join(standard_columns(self.quantity, len(self.offset)))}.",
                )
            raw = np.linalg.solve(self.matrix, raw.T).T
        return {name: raw[:, i] / self.factor[i] for i, name in enumerate(self.columns)}

    def column_of(self, value: int) -> str:
        """The column that value number `value` comes from."""
        return self.columns[value] if self.matrix is None else self.columns[0]


def standard_columns(quantity: str, n: int) -> tuple[str, ...]:
    """The names of a quantity's columns in a file of an n-joint robot."""
    if quantity in JOINT_QUANTITIES:
        return tuple(f"{quantity}{i + 1}" for i in range(n))
    return VECTORS.get(quantity, (quantity,))


def standard_signal(quantity: str, n: int) -> Signal:
    """A quantity that stands in SI units under its own names."""
    columns = standard_columns(quantity, n)
    return Signal(quantity, columns, np.ones(len(columns)), None, np.zeros(len(columns)))


def timestamp_columns(signals: Mapping[str, Signal]) -> tuple[str, ...]:
    """The columns of texts among those of the signals."""
    return tuple(column for signal in signals.values() if signal.timestamps for column in signal.columns)


def mapped_signals(model: RobotModel) -> dict[str, Signal]:
    """Signals declared in `signals:` of robot.yaml; raises `InputError` with its line if they are inconsistent."""
    declared = model.config.signals
    return {name: _mapped(model, name, declared[name]) for name in declared}


def assign(
    file: TableFile,
    model: RobotModel,
    required: Sequence[str],
    optional: Sequence[str],
    texts: Sequence[str] = (),
) -> dict[str, Signal]:
    """Columns of a file for each quantity: the mapped ones if present, else the standard ones.

    Raises `InputError` for a required quantity that is missing, one that is only there in part, another number of
    joints than the robot's, and every column that is read and not understood.
    """
    mapped = mapped_signals(model)
    assigned: dict[str, Signal] = {}
    for quantity in (*required, *optional):
        choice = _choose(file, quantity, model.n, mapped.get(quantity), quantity in required)
        if choice is not None:
            assigned[quantity] = choice
    used = {column for signal in assigned.values() for column in signal.columns} | set(texts)
    used |= {joint.name for i, joint in enumerate(model.joints) if i not in model.motors}
    known = [name for quantity in (*required, *optional) for name in standard_columns(quantity, model.n)]
    known += [
        name for quantity in (*required, *optional) if quantity in mapped for name in mapped[quantity].columns
    ]
    for column in file.columns:
        if column not in used and column not in file.unread:
            hint = (
                suggestion(column, [*known, *texts]) or "; rename it, map it under `signals:`, or remove it."
            )
            raise file.error("E-TABLE-004", f"the column '{column}' is not known{hint}")
    return assigned


def _check_celsius(table: Table, column: str, values: np.ndarray) -> None:
    wrong = (values < COLDEST) | (values > HOTTEST)
    if wrong.any():
        row = int(np.argmax(wrong))
        hint = " Or say the column's unit, degF or K, by `unit:` under `signals:` of robot.yaml, or by 'flexcal import --map'."
        raise table.error(
            "E-TABLE-044",
            row,
            column,
            f"the temperature {temperature_fault(float(values[row]))}{hint if wrong.all() and values[row] < 400 else ''}",
        )


def _choose(file: TableFile, quantity: str, n: int, mapped: Signal | None, required: bool) -> Signal | None:
    if mapped is not None:
        missing = [name for name in mapped.columns if name not in file.columns]
        if not missing:
            return mapped
        if len(missing) < len(mapped.columns):
            raise file.error(
                "E-TABLE-005",
                f"the column '{missing[0]}', which `signals:` names for {quantity}, is missing; add it.",
            )
    standard = standard_signal(quantity, n)
    if quantity in JOINT_QUANTITIES:
        _check_joint_count(file, quantity, n)
    missing = [name for name in standard.columns if name not in file.columns]
    if not missing:
        return standard
    if len(missing) < len(standard.columns) or required:
        instead = f" (or {', '.join(mapped.columns)} of `signals:`)" if mapped is not None else ""
        near = suggestion(missing[0], [name for name in file.columns if name not in standard.columns])
        elsewhere = ", or map it under `signals:`" if quantity in JOINT_QUANTITIES and mapped is None else ""
        raise file.error(
            "E-TABLE-006", f"the column '{missing[0]}'{instead} is missing{near or f'; add it{elsewhere}.'}"
        )
    return None


def _check_joint_count(file: TableFile, quantity: str, n: int) -> None:
    numbers = [
        int(m[1]) for name in file.columns if (m := re.fullmatch(rf"{quantity}([1-9][0-9]{{0,4}})", name))
    ]
    count = len(numbers)
    if count and sorted(numbers) == list(range(1, count + 1)) and count != n:
        raise file.error(
            "E-TABLE-007",
            f"there are {count} columns {quantity}1…{quantity}{count}, but the robot has {n} joints; "
            f"give {quantity}1…{quantity}{n}, or check that this is the right robot.yaml.",
        )


def _mapped(model: RobotModel, name: str, config: SignalConfig) -> Signal:
    def wrong(code: str, key: str, sentence: str) -> InputError:
        return read_yaml_file(model.path).error(code, ("signals", name, key), f"signals.{name}: {sentence}")

    sensors = {sensor.column: SENSOR_UNITS[sensor.order] for sensor in model.sensors.values()}
    known = {**UNITS, **sensors}
    if name not in known:
        raise wrong(
            "E-TABLE-008",
            "",
            f"this quantity is not known{suggestion(name, list(known)) or '; known are ' + ', '.join(known) + '.'}",
        )
    k, m = len(config.columns), len(standard_columns(name, model.n))
    unit = 1.0
    if config.unit is not None:
        if config.unit not in known[name]:
            listed = ", ".join(known[name]) or "none"
            raise wrong(
                "E-TABLE-009", "unit", f"the unit '{config.unit}' does not fit; possible are {listed}."
            )
        unit = known[name][config.unit]
        if config.unit in ("A", "mA") and config.gain is None and config.matrix is None:
            raise wrong(
                "E-TABLE-010",
                "unit",
                "currents become torques only by a gain; add `gain:` with N m/A, one per column.",
            )
    if len(set(config.columns)) != k:
        raise wrong("E-TABLE-011", "columns", "a column stands twice; name each once.")
    if config.gain is not None and len(config.gain) != k:
        raise wrong(
            "E-TABLE-012", "gain", f"there are {len(config.gain)} gains for {k} columns; give one each."
        )
    if config.offset is not None and len(config.offset) != m:
        raise wrong(
            "E-TABLE-013", "offset", f"there are {len(config.offset)} offsets for {m} values; give one each."
        )
    matrix = None
    if config.matrix is not None:
        matrix = read_matrix(model.path.parent / config.matrix)
        if matrix.shape != (m, k):
            raise wrong(
                "E-TABLE-014",
                "matrix",
                f"{config.matrix} is {matrix.shape[0]} × {matrix.shape[1]}, but {m} × {k} is needed.",
            )
    elif k != m:
        raise wrong(
            "E-TABLE-015",
            "columns",
            f"{k} columns are named, but {m} are needed ({', '.join(standard_columns(name, model.n))}).",
        )
    gain = np.ones(k) if config.gain is None else np.array(config.gain)
    offset = np.zeros(m) if config.offset is None else np.array(config.offset)
    offset = (offset + ZEROS.get(config.unit or "", 0.0)) * unit
    return Signal(name, tuple(config.columns), gain * unit, matrix, offset, config.unit == TIMESTAMP)


def read_matrix(path: str | Path) -> np.ndarray:
    """A matrix (m, k) from CSV without a header; raises `InputError` with line and column of what is no number."""
    path = Path(path)
    try:
        lines = read_text(path, encoding="utf-8-sig", limit=MEGABYTE).splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise unreadable(path, problem) from problem
    rows: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        rows.append([])
        for column, cell in enumerate(line.split(","), start=1):
            try:
                rows[-1].append(float(cell))
            except ValueError:
                raise InputError(
                    "E-TABLE-016",
                    f"{path} line {number}, column {column}: '{excerpt(cell)}' is not a number; correct it.",
                ) from None
        if len(rows[-1]) != len(rows[0]) or not np.isfinite(rows[-1]).all():
            raise InputError(
                "E-TABLE-017",
                f"{path} line {number}: {len(rows[0])} finite numbers are needed here; correct it.",
            )
    if not rows:
        raise InputError(
            "E-TABLE-018", f"{path} line 1: the file is empty; write the matrix, one row a line."
        )
    return np.array(rows)
