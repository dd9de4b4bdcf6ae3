"""Single columns of files with poses or targets, checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables import Signal, Table, TableFile
from flexcal.files.structuring import suggestion
from flexcal.units import LEAST_STD

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_HIGHEST = 2.0**53
"""Largest integer that is exact in a table."""
_FEWEST, _SEVERAL = 20, 1000
"""Different numbers from which they have a last digit, and rows that are looked at."""
_DECIMALS = 16
_ROUNDING = 4
"""Distance of a number in a table from its decimals, in units of its last binary digit, after a conversion of its unit."""


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


def without_ways(file: TableFile, model: RobotModel) -> TableFile:
    """File without reading the columns by which a plan leads the robot to its poses."""
    ways = {f"via{i + 1}" for i in range(model.n)}
    return file.leaving_out([name for name in file.columns if name in ways])


def approach_columns(table: Table, signals: dict[str, Signal]) -> np.ndarray | None:
    """Signs (N, n) of the joints' last motions, where there are such columns; raises `InputError` at the first that is none."""
    if "approach" not in signals:
        return None
    signs = signals["approach"].values(table)
    wrong = ~np.isin(signs, (-1.0, 0.0, 1.0))
    if wrong.any():
        row, joint = (int(i) for i in np.argwhere(wrong)[0])
        raise table.error(
            "E-POSES-084",
            row,
            signals["approach"].column_of(joint),
            f"approach is {signs[row, joint]:g}, but must be 1 or -1, the direction of the joint's last motion, or 0 where it is not "
            "known; correct it.",
        )
    return signs


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


def last_digit(values: np.ndarray) -> float:
    """Place of the last decimal of numbers, as 1e-6; that of double precision where they have no common one, or are too few to tell."""
    several = np.unique(values[np.linspace(0, len(values) - 1, min(len(values), _SEVERAL)).astype(int)])
    finest = np.spacing(np.abs(several))
    for decimals in range(_DECIMALS if len(several) >= _FEWEST else 0):
        if (np.abs(several - np.round(several, decimals)) <= _ROUNDING * finest).all():
            return 10.0**-decimals
    return float(finest.max())


def check_noise(table: Table, signal: Signal, sigma: np.ndarray, measured: np.ndarray) -> None:
    """Raise `InputError` at the first standard deviation `sigma` (N, k) that is not positive, or less than the digits of the `measured`
    numbers (N, m) can carry.
    """
    check_positive(table, signal, sigma, zero=False)
    digit = last_digit(measured)
    rounding = digit / np.sqrt(12)  # standard deviation of a uniform distribution over one digit
    wrong = sigma < max(rounding, LEAST_STD)
    if wrong.any():
        row, column = (int(i) for i in np.argwhere(wrong)[0])
        reason = (
            f"the measured numbers end at {digit:.0e}, whose rounding alone has a standard deviation of {rounding:.1e}"
            if rounding > LEAST_STD
            else f"no instrument's is below {LEAST_STD:.0e}"
        )
        raise table.error(
            "E-POSES-083",
            row,
            signal.column_of(column),
            f"{signal.quantity} is {sigma[row, column]:g} in SI units, but {reason}; state the instrument's noise, or leave the column "
            "out.",
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
