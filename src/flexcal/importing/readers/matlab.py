"""MATLAB's MAT-files, also those of version 7.3, which are HDF5."""

from __future__ import annotations

import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, open_regular, regular_path, size_text
from flexcal.importing.tables import ForeignTable

_LARGEST = 500 * MEGABYTE
"""Bytes of a file, and of its values once they are unpacked."""
_MOST_VARIABLES = 10_000
_DEEPEST = 20
_COMPRESSED = 15
"""Type of a data element that is packed by zlib."""


def read_hdf5_mat(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Variables (N,) or (N, M) of numbers as MATLAB has them, fields of structs as name.field, and the names of all others.

    Raises `InputError` where h5py is not installed, and where the file is damaged.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            "E-IMPORT-029",
            f"{path}: MAT-files of version 7.3 need h5py: pip install h5py; or save it again with save(…, '-v7').",
        ) from None
    variables: dict[str, np.ndarray] = {}
    others: list[str] = []

    visited: list[str] = []
    size = 0

    def is_own(group: Any, name: str) -> bool:
        """Whether a link leads to something in this file."""
        return isinstance(group.get(name, getlink=True), h5py.HardLink)

    def collect(name: str, item: Any) -> None:
        kind = item.attrs.get("MATLAB_class", b"")
        kind = kind.decode() if isinstance(kind, bytes) else str(kind)
        nonlocal size
        visited.append(name)
        if len(visited) > _MOST_VARIABLES or name.count(".") > _DEEPEST:
            raise InputError(
                "E-IMPORT-071",
                f"{path}: its structs hold more than {_MOST_VARIABLES} variables or nest more than {_DEEPEST} deep; save the columns.",
            )
        if isinstance(item, h5py.Group) and kind in ("", "struct") and "MATLAB_sparse" not in item.attrs:
            for field in item:
                if is_own(item, str(field)):
                    collect(f"{name}.{field}", item[field])
        elif isinstance(item, h5py.Dataset) and kind in _NUMBERS and "MATLAB_empty" not in item.attrs:
            stored_here = item.external is None and not item.is_virtual
            if stored_here and item.dtype.kind in "fiub" and item.ndim == 2:
                size += 8 * int(item.size or 0)
                _require_size(path, size)
                variables[name] = np.squeeze(np.asarray(item[()]).T).astype(float)
            else:
                others.append(name)
        else:
            others.append(name)

    try:
        with h5py.File(regular_path(path, limit=_LARGEST), "r") as file:
            for name in file:
                if not str(name).startswith("#") and is_own(file, str(name)):
                    collect(str(name), file[name])
    except InputError:
        raise
    except Exception as problem:  # of a damaged file, such as KeyError of a name that its own list has
        reason = " ".join(str(problem).split()) or type(problem).__name__
        raise InputError(
            "E-IMPORT-030", f"{path}: not a readable MAT-file ({reason}); save it again with '-v7'."
        ) from problem
    return {name: value for name, value in variables.items() if value.ndim}, others + [
        name for name, value in variables.items() if not value.ndim
    ]


_NUMBERS = ("double", "single", "logical", *(f"{u}int{bits}" for u in ("", "u") for bits in (8, 16, 32, 64)))
"""Classes of MATLAB whose values are numbers."""


def read_mat(path: Path) -> ForeignTable:
    """Read the variables of a MAT-file as columns, structs as name.field and matrices as name[0], name[1], …

    Rows are the length that most variables share; what has another shape is left out and named. Raises `InputError` where the file is
    none or holds no numbers, and for version 7.3 as `read_hdf5_mat` does.
    """
    variables, others = _variables(path)
    lengths = Counter(length for value in variables.values() for length in set(value.shape) if length > 1)
    if not lengths:
        raise InputError(
            "E-IMPORT-031",
            f"{path}: it holds no columns of numbers; table objects are not supported: save their columns.",
        )
    most = max(lengths.values())
    rows = max(length for length, count in lengths.items() if count == most)
    columns: dict[str, np.ndarray] = {}
    for name, value in variables.items():
        if value.ndim == 1 and len(value) == rows:
            columns[name] = value
        elif value.ndim == 2 and rows in value.shape:
            matrix = value if value.shape[0] == rows else value.T
            columns |= {f"{name}[{k}]": matrix[:, k] for k in range(matrix.shape[1])}
        else:
            others.append(name)
    notes = (f"no column of {rows} rows, left out: {', '.join(others)}",) if others else ()
    return ForeignTable(Table(TableFile(path, tuple(columns), 1), 1, columns), notes=notes)


def _variables(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Variables (N,) or (N, M) of numbers by name, and the names of all others."""
    from scipy.io import loadmat

    _require_size(path, _unpacked(path))
    try:
        content = loadmat(
            regular_path(path, limit=_LARGEST), squeeze_me=True, struct_as_record=False, mat_dtype=True
        )
    except NotImplementedError:  # version 7.3
        return read_hdf5_mat(path)
    except Exception as problem:  # a reader of a broken file may raise anything
        reason = " ".join(str(problem).split()) or type(problem).__name__
        raise InputError(
            "E-IMPORT-032", f"{path}: not a readable MAT-file ({reason}); save it again with '-v7'."
        ) from problem
    variables: dict[str, np.ndarray] = {}
    others: list[str] = []
    for name, value in content.items():
        if not name.startswith("__"):
            _collect(name, value, variables, others)
    return variables, others


def _unpacked(path: Path) -> int:
    """Bytes of a MAT-file of version 5 with its packed elements unpacked, as far as they can be; at least the size of any other."""
    size = 0
    try:
        with open_regular(path, limit=_LARGEST) as stream:
            order = {b"IM": "little", b"MI": "big"}.get(stream.read(128)[126:])
            while order is not None and len(tag := stream.read(8)) == 8:
                kind, length = (int.from_bytes(part, order) for part in (tag[:4], tag[4:]))  # type: ignore[arg-type]
                if kind != _COMPRESSED:
                    stream.seek(length, 1)
                    continue
                unpacking, left = zlib.decompressobj(), length
                while left > 0 and (packed := stream.read(min(left, 2**16))) and size <= _LARGEST:
                    left -= len(packed)
                    while packed and size <= _LARGEST:
                        size += len(unpacking.decompress(packed, 2**20))
                        packed = unpacking.unconsumed_tail
            return size
    except OSError as problem:
        raise unreadable(path, problem) from problem
    except zlib.error:  # the reader says what is wrong
        return size


def _require_size(path: Path, size: int) -> None:
    if size > _LARGEST:
        raise InputError(
            "E-IMPORT-072",
            f"{path} holds more than {size_text(_LARGEST)} of values, which are not read at once; save fewer of them.",
        )


def _collect(name: str, value: Any, variables: dict[str, np.ndarray], others: list[str]) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        for field in fields:
            _collect(f"{name}.{field}", getattr(value, field), variables, others)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and 1 <= value.ndim <= 2:
        variables[name] = value.astype(float)
    else:
        others.append(name)
