"""Single columns of files with poses or targets, checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables import Signal, Table, TableFile
from flexcal.files.structuring import suggestion

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_HIGHEST = 2.0**53
"""Largest integer that is exact in a table."""


def first_point(file: TableFile, model: RobotModel) -> str:
    """The default target; raises `InputError` where robot.yaml declares none."""
    if not model.points:
        raise file.error("E-POSES-008", "robot.yaml declares no point; add the measured one under `points:`.")
    return next(iter(model.points))


def payload_column(table: Table, signals: dict[str, Signal], model: RobotModel) -> np.ndarray | None:
    """Payload (N,), kg, where there is such a column; raises `InputError` for a negative one and where robot.yaml declares none."""
    if "payload" not in signals:
        return None
    if model.payload is None:
        raise table.file.error(
            "E-POSES-009",
            "there is a column 'payload', but robot.yaml declares none; add `payload:` with its centre of mass.",
        )
    payload = signals["payload"].values(table)
    check_positive(table, signals["payload"], payload, zero=True)
    return payload[:, 0]


def target_column(table: Table, model: RobotModel) -> np.ndarray:
    """Names (N,) of points; raises `InputError` at the first that robot.yaml does not have."""
    target = table.columns["target"]
    for row, name in enumerate(target.tolist()):
        if name not in model.points:
            known = list(model.points)
            hint = suggestion(name, known) or f"; known are {', '.join(known) or 'none'}."
            raise table.error(
                "E-POSES-010", row, "target", f"there is no point '{name}' under `points:`{hint}"
            )
    return target


def check_positive(table: Table, signal: Signal, values: np.ndarray, *, zero: bool) -> None:
    """Raise `InputError` at the first of `values` (N, k) that is negative, or zero unless `zero` is allowed."""
    wrong = values < 0 if zero else values <= 0
    if wrong.any():
        row, column = (int(i) for i in np.argwhere(wrong)[0])
        word = "not negative" if zero else "positive"
        raise table.error(
            "E-POSES-011",
            row,
            signal.column_of(column),
            f"{signal.quantity} is {values[row, column]:g}, but must be {word}; correct it.",
        )


def whole_numbers(table: Table, column: str, values: np.ndarray) -> np.ndarray:
    """Numbers (N,) of poses, which stand in `column`, as integers; raises `InputError` at the first that is none."""
    if (values != np.rint(values)).any():
        row = int(np.argmax(values != np.rint(values)))
        raise table.error(
            "E-POSES-012", row, column, f"{values[row]:g} is no whole number; number the poses."
        )
    if (np.abs(values) > _HIGHEST).any():
        row = int(np.argmax(np.abs(values) > _HIGHEST))
        raise table.error(
            "E-POSES-013",
            row,
            column,
            f"{values[row]:g} is too large for the number of a pose; number the poses.",
        )
    return values.astype(np.int64)


def unit_quaternions(table: Table, signal: Signal, quaternion: np.ndarray) -> np.ndarray:
    """Quaternions (N, 4) of unit norm; raises `InputError` at the first that is off by more than 1e-3."""
    norm = np.linalg.norm(quaternion, axis=1)
    if (np.abs(norm - 1) > 1e-3).any():
        row = int(np.argmax(np.abs(norm - 1) > 1e-3))
        raise table.error(
            "E-POSES-014",
            row,
            signal.columns[0],
            f"the quaternion has the norm {norm[row]:.4g}, not 1; check the columns qw, qx, qy, qz.",
        )
    return quaternion / norm[:, None]
