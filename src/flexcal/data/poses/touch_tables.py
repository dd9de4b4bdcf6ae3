"""Touches on disk: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import payload_column, whole_numbers
from flexcal.data.poses.touches import Touches
from flexcal.data.tables import Table, TableFile, assign, check_joint_units, open_table
from flexcal.errors import InputError

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_UNUSED = ("tau", "temperature", "t")
DEFAULT_POINT = "point"
"""Name of the fixed point where a file does not name it."""


def read_touches(paths: str | Path | Sequence[str | Path], model: RobotModel) -> Touches:
    """Read the poses in which the tip of a tool touches fixed points.

    Parameters
    ----------
    paths : str or Path, or sequence of these
        CSV or Parquet tables with q1…qn (rad or m), and optionally `pose`, `point` (the name of the fixed point) and `payload` (kg).
    model : RobotModel
        Robot whose joints the columns number.

    Returns
    -------
    Touches
        One row a touch.

    Raises
    ------
    InputError
        With file, line and column, for a missing or unknown column, a value that is missing or no number, and angles that cannot be in
        rad.
    """
    return _joined([_touches(open_table(path), model) for path in _listed(paths)])


def _listed(paths: str | Path | Sequence[str | Path]) -> list[str | Path]:
    return [paths] if isinstance(paths, str | Path) else list(paths)


def _touches(file: TableFile, model: RobotModel) -> Touches:
    if {"x", "y", "z"} <= set(file.columns):
        raise file.error(
            "E-TOOL-004",
            "there are measured points x, y, z, which a tip that touches a point does not need; remove these columns, or find the place "
            "of a measured point on the tool with 'flexcal calibrate'.",
        )
    texts = tuple(name for name in ("point",) if name in file.columns)
    table, q, pose, payload = _poses(file, model, texts)
    touched = table.columns["point"] if texts else np.full(len(q), DEFAULT_POINT)
    return Touches(q, touched, pose, payload, place=_places(table))


def _poses(
    file: TableFile, model: RobotModel, texts: tuple[str, ...]
) -> tuple[Table, np.ndarray, np.ndarray, np.ndarray | None]:
    signals = assign(file, model, ("q",), ("pose", "payload", *_UNUSED), texts)
    table = file.read(texts)
    q = signals["q"].values(table)
    check_joint_units(model, table, signals["q"], q)
    pose = np.arange(1, len(q) + 1)
    if "pose" in signals:
        pose = whole_numbers(table, signals["pose"].columns[0], signals["pose"].values(table)[:, 0])
    return table, q, pose, payload_column(table, signals, model)


def _places(table: Table) -> tuple[str, ...]:
    file = table.file
    return tuple(f"{file.path} {file.row_word} {table.first + row}" for row in range(len(table)))


def _joined(parts: Sequence[Touches]) -> Touches:
    if len({part.payload is None for part in parts}) > 1:
        raise InputError("E-TOOL-005", "only some files have a column payload; give it in all, or in none.")

    payloads = [part.payload for part in parts if part.payload is not None]
    return Touches(
        np.concatenate([part.q for part in parts]),
        np.concatenate([part.touched for part in parts]),
        np.concatenate([part.pose for part in parts]),
        np.concatenate(payloads) if payloads else None,
        tuple(place for part in parts for place in part.place),
    )
