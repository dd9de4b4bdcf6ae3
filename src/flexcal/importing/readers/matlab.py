"""MATLAB's MAT-files, also those of version 7.3, which are HDF5."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError
from flexcal.importing.tables import ForeignTable


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

    def collect(name: str, item: Any) -> None:
        kind = item.attrs.get("MATLAB_class", b"")
        kind = kind.decode() if isinstance(kind, bytes) else str(kind)
        if isinstance(item, h5py.Group) and kind in ("", "struct") and "MATLAB_sparse" not in item.attrs:
            for field in item:
                collect(f"{name}.{field}", item[field])
        elif isinstance(item, h5py.Dataset) and kind in _NUMBERS and "MATLAB_empty" not in item.attrs:
            value = np.asarray(item[()])
            if value.dtype.kind in "fiub" and value.ndim == 2:
                variables[name] = np.squeeze(value.T).astype(float)
            else:
                others.append(name)
        else:
            others.append(name)

    try:
        with h5py.File(path, "r") as file:
            for name, item in file.items():
                if not str(name).startswith("#"):
                    collect(str(name), item)
    except (OSError, RuntimeError) as problem:
        reason = " ".join(str(problem).split())
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

    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False, mat_dtype=True)
    except NotImplementedError:  # version 7.3
        from flexcal.importing.readers.matlab import read_hdf5_mat

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


def _collect(name: str, value: Any, variables: dict[str, np.ndarray], others: list[str]) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        for field in fields:
            _collect(f"{name}.{field}", getattr(value, field), variables, others)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and 1 <= value.ndim <= 2:
        variables[name] = value.astype(float)
    else:
        others.append(name)
