"""Touches on disk: CSV or Parquet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import payload_column, whole_numbers
from flexcal.data.poses.frame_touches import KNOWN_BY_NAME, FrameMethod, FrameTouches
from flexcal.data.poses.target_files import OF_COMMANDS
from flexcal.data.poses.touches import Touches
from flexcal.data.tables import Table, TableFile, assign, check_joint_units, open_table
from flexcal.errors import InputError

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_UNUSED = ("tau", "temperature", "t", "approach")
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
    table, q, pose, payload, _ = _poses(file, model, texts)
    touched = table.columns["point"] if texts else np.full(len(q), DEFAULT_POINT)
    return Touches(q, touched, pose, payload, place=_places(table))


def read_frame_touches(paths: str | Path | Sequence[str | Path], model: RobotModel) -> FrameTouches:
    """Read the poses in which the tip of a tool touches a work object.

    Parameters
    ----------
    paths : str or Path, or sequence of these
        CSV or Parquet tables with q1…qn (rad or m) and what was touched: `wx`, `wy`, `wz`, the coordinates of the point in the work
        object's frame (m), with its name as `point` if it has one; or `face`, 1, 2 or 3; or `point` alone, with the names origin, x and xy,
        or x1, x2 and y1. Optionally `pose` and `payload` (kg).
    model : RobotModel
        Robot whose joints the columns number.

    Returns
    -------
    FrameTouches
        One row a touch.

    Raises
    ------
    InputError
        As `read_touches`, and where the columns or names do not tell what was touched.
    """
    parts = [_frame_touches(open_table(path), model) for path in _listed(paths)]
    methods = {part.method for part in parts}
    if len(methods) > 1:
        raise InputError(
            "E-TOOL-010",
            "the files say in different ways what was touched; give wx, wy, wz in all of them, or face in all, or names of points.",
        )
    return FrameTouches(
        _joined([part.touches for part in parts]),
        np.concatenate([part.known for part in parts]),
        parts[0].method,
    )


def _frame_touches(file: TableFile, model: RobotModel) -> FrameTouches:
    given = {"wx", "wy", "wz"} & set(file.columns)
    if "face" in file.columns and (given or "point" in file.columns):
        raise file.error(
            "E-TOOL-011",
            "there are points and faces; give `face` alone, or `point` with wx, wy, wz, in files of their own.",
        )
    if not given and not {"point", "face"} & set(file.columns):
        raise file.error(
            "E-TOOL-012",
            "nothing says what was touched; add wx, wy, wz (coordinates of the point in the work object's frame, m), or face (1, 2 or 3), "
            "or point (origin, x, xy).",
        )
    texts = tuple(name for name in ("point", "face") if name in file.columns)
    table, q, pose, payload, known = _poses(file, model, texts, ("work_xyz",) if given else ())
    if known is not None:
        touched = (
            table.columns["point"] if texts else np.array([f"({x:g}, {y:g}, {z:g})" for x, y, z in known])
        )
        _require_one_place(table, touched, known)
        return FrameTouches(Touches(q, touched, pose, payload, _places(table)), known, "points")
    touched = table.columns[texts[0]]
    method = _method(table, texts[0], touched)
    known = np.array([KNOWN_BY_NAME[method][name] for name in touched.tolist()])
    return FrameTouches(Touches(q, touched, pose, payload, _places(table)), known, method)


def _method(table: Table, column: str, touched: np.ndarray) -> FrameMethod:
    """Method whose names these are."""
    methods: tuple[FrameMethod, ...] = ("faces",) if column == "face" else ("origin_x_xy", "x1_x2_y1")
    for method in methods:
        if touched[0] in KNOWN_BY_NAME[method]:
            for row, name in enumerate(touched.tolist()):
                if name not in KNOWN_BY_NAME[method]:
                    raise table.error(
                        "E-TOOL-013",
                        row,
                        column,
                        f"'{name}' does not go with '{touched[0]}'; names are {', '.join(KNOWN_BY_NAME[method])}.",
                    )
            return method
    ways = " or ".join(", ".join(KNOWN_BY_NAME[method]) for method in methods)
    more = "" if column == "face" else ", or add wx, wy, wz, its coordinates in the work object's frame (m)"
    raise table.error(
        "E-TOOL-014", 0, column, f"nothing says where '{touched[0]}' is; name it as one of {ways}{more}."
    )


def _require_one_place(table: Table, touched: np.ndarray, known: np.ndarray) -> None:
    first: dict[str, int] = {}
    for row, name in enumerate(touched.tolist()):
        before = first.setdefault(name, row)
        if (known[before] != known[row]).any():
            raise table.error(
                "E-TOOL-015",
                row,
                "point",
                f"'{name}' has other coordinates wx, wy, wz than in {table.file.row_word} {table.number_of(before)}; a point has one "
                "place, or another name.",
            )


def _poses(
    file: TableFile, model: RobotModel, texts: tuple[str, ...], more: tuple[str, ...] = ()
) -> tuple[Table, np.ndarray, np.ndarray, np.ndarray | None, np.ndarray | None]:
    file = file.leaving_out([name for name in OF_COMMANDS if name in file.columns])
    signals = assign(file, model, ("q", *more), ("pose", "payload", *_UNUSED), texts)
    table = file.read(texts)
    q = signals["q"].values(table)
    check_joint_units(model, table, signals["q"], q)
    pose = np.arange(1, len(q) + 1)
    if "pose" in signals:
        pose = whole_numbers(table, signals["pose"].columns[0], signals["pose"].values(table)[:, 0])
    known = signals[more[0]].values(table) if more else None
    return table, q, pose, payload_column(table, signals, model), known


def _places(table: Table) -> tuple[str, ...]:
    file = table.file
    return tuple(f"{file.path} {file.row_word} {table.number_of(row)}" for row in range(len(table)))


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
