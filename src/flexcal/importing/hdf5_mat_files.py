"""MATLAB's MAT-files of version 7.3, which are HDF5."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flexcal.errors import InputError


def read_hdf5_mat(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Variables (N,) or (N, M) of numbers as MATLAB has them, fields of structs as name.field, and the names of all others.

    Raises `InputError` where h5py is not installed, and where the file is damaged.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"{path}: MAT-files of version 7.3 need h5py: pip install h5py; or save it again with save(…, '-v7')."
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
            f"{path}: not a readable MAT-file ({reason}); save it again with '-v7'."
        ) from problem
    return {name: value for name, value in variables.items() if value.ndim}, others + [
        name for name, value in variables.items() if not value.ndim
    ]


_NUMBERS = ("double", "single", "logical", *(f"{u}int{bits}" for u in ("", "u") for bits in (8, 16, 32, 64)))
"""Classes of MATLAB whose values are numbers."""
