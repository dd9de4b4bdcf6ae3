"""Universal files: the time histories of their data sets 58."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, read_bytes, regular_path
from flexcal.importing.tables import ForeignTable

_LARGEST = 512 * MEGABYTE
_FUNCTION, _TIME_RESPONSE = 58, 1
_DIRECTIONS = ("", "X", "Y", "Z", "RX", "RY", "RZ")
_DELIMITER = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
"""As pyuff finds it: after binary values it does not begin a line."""
_ANNOUNCED = re.compile(rb"    -1[^\n]*\n    58[^\n]*\n(?:[^\n]*\n){6}.{10} *([0-9]+)")
"""Number of values, in the second field of the seventh line of a data set 58."""
_SAME_CLOCK = 1e-6
"""Share of a step by which two histories may be sampled apart."""


def read_uff(path: Path) -> ForeignTable:
    """Read the time histories of a universal file as columns, beside their time `t`.

    They are called by their first line of text where these tell them apart, else by node and direction, as node 3 +Z. What is sampled at
    other times than most, or is no time history, is left out and named. Raises `InputError` where pyuff is not installed, the file is
    none, or holds no time history.
    """
    try:
        import pyuff
    except ImportError:
        raise InputError("E-IMPORT-046", f"{path}: universal files need pyuff: pip install pyuff.") from None
    _require_whole(path)
    try:
        file = pyuff.UFF(str(regular_path(path, limit=_LARGEST)))
        kinds = [int(kind) for kind in file.get_set_types()]
    except Exception as problem:  # of no class of its own
        raise InputError(
            "E-IMPORT-047", f"{path}: not a readable universal file; export it again."
        ) from problem
    sets = [_data_set(path, file, k) for k, kind in enumerate(kinds) if kind == _FUNCTION]
    timed = [item for item in sets if item is not None]
    if not timed:
        raise InputError(
            "E-IMPORT-048",
            f"{path}: it holds no time history (data set 58, function type 1); export the recording as such.",
        )
    names = _names(timed)
    clocks = [np.asarray(item["x"], dtype=float) for item in timed]
    alike = [[_same(a, b) for b in clocks] for a in clocks]
    chosen = alike[int(np.argmax([sum(row) for row in alike]))]
    clock = clocks[chosen.index(True)]
    columns = {"t": clock}
    units = {"t": "s"}
    left = [name for name, same in zip(names, chosen, strict=True) if not same]
    for name, item, same in zip(names, timed, chosen, strict=True):
        if same:
            columns[name] = np.real(np.asarray(item["data"])).astype(float)
            units[name] = str(item.get("ordinate_axis_units_lab", "")).strip()
    notes = [f"sampled at other times, left out: {', '.join(left)}"] if left else []
    if len(timed) < len(kinds):
        notes.append(f"data sets that are no time histories, left out: {len(kinds) - len(timed)}")
    return ForeignTable(Table(TableFile(path, tuple(columns), 1), 1, columns), units, notes=tuple(notes))


def _require_whole(path: Path) -> None:
    """Raise `InputError` for a file that cannot be read, or whose last data set has no end: what pyuff leaves out."""
    try:
        content = read_bytes(path, limit=_LARGEST)
    except OSError as problem:
        raise unreadable(path, problem) from problem
    if any(float(count) > len(content) for count in _ANNOUNCED.findall(content)):
        raise InputError(
            "E-IMPORT-070",
            f"{path}: a data set announces more values than the file can hold; export it again.",
        )
    if len(_DELIMITER.findall(content)) % 2:
        raise InputError(
            "E-IMPORT-049", f"{path}: its last data set has no end, so the file was cut off; export it again."
        )


def _data_set(path: Path, file: Any, index: int) -> dict[str, Any] | None:
    """A data set 58 with as many values as its header announces; None of one that is no time history."""
    place = f"{path}: data set {index + 1}"
    try:
        with np.errstate(all="ignore"):
            item = file.read_sets(index)
        timed, announced, values = (
            int(item["func_type"]) == _TIME_RESPONSE,
            int(item["num_pts"]),
            len(item["data"]),
        )
    except Exception as problem:  # of no class of its own, and without a reason
        raise InputError(
            "E-IMPORT-050",
            f"{place} does not have the lines and fields of a data set 58; export the file again.",
        ) from problem
    if not timed:
        return None
    padded = bool(item.get("binary")) and values > announced > 0
    if values != announced and not padded:
        raise InputError(
            "E-IMPORT-051",
            f"{place} announces {announced} values, but {values} can be read from it; export the file again.",
        )
    x, data = np.asarray(item["x"], dtype=float)[:announced], np.asarray(item["data"])[:announced]
    if not (announced and np.isfinite(x).all()):
        raise InputError(
            "E-IMPORT-052",
            f"{place} has {'no finite time axis' if announced else 'no values'}; export the file again.",
        )
    return {**item, "x": x, "data": data}


def _names(timed: Sequence[Mapping[str, Any]]) -> list[str]:
    """The histories' first lines, or their nodes and directions, numbered where these are the same."""
    lines = [str(item.get("id1", "")).strip() for item in timed]
    if len(set(lines)) == len(lines) and not {"", "NONE", "t"} & set(lines):
        return lines
    names = []
    for item in timed:
        direction = int(item.get("rsp_dir", 0))
        sign = "-" if direction < 0 else "+"
        names.append(f"node {int(item.get('rsp_node', 0))} {sign}{_DIRECTIONS[abs(direction)]}".rstrip("+ "))
    return [name if names.count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(names)]


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    return len(a) == len(b) and bool(np.allclose(a, b, rtol=0, atol=_SAME_CLOCK * np.ptp(a) / len(a)))
