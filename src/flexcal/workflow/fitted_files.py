"""Measured and fitted frequency responses: fitted_responses.npz."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from flexcal.atomic import atomic_path
from flexcal.errors import InputError
from flexcal.report.fitted_response import FittedResponse

FITTED = "fitted_responses.npz"

_SINGLE = {"complex128": np.complex64, "float64": np.float32}
"""What a figure can show needs no more digits."""


def write_fitted(folder: Path, responses: Sequence[FittedResponse]) -> None:
    """Leave `responses` as fitted_responses.npz in `folder`, atomically: the fields of `FittedResponse` as `<name>_<pose>`, poses from 1,
    (L, n, n) arrays in single precision."""
    arrays: dict[str, np.ndarray] = {"pose": np.array([item.pose + 1 for item in responses])}
    for item in responses:
        for field in fields(item)[1:]:
            array = np.asarray(getattr(item, field.name))
            small = array.astype(_SINGLE[array.dtype.name]) if array.ndim == 3 else array
            arrays[f"{field.name}_{item.pose + 1}"] = small
    with atomic_path(folder / FITTED) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def read_fitted(folder: Path) -> tuple[FittedResponse, ...]:
    """What `write_fitted` left; raises `InputError` where the file is not there or not such a one."""
    path = folder / FITTED
    try:
        with np.load(path) as file:
            return tuple(_response(file, pose) for pose in file["pose"].tolist())
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else problem
        raise InputError(f"{path} cannot be read ({reason}); run the verb that writes it again.") from problem


def _response(file: np.lib.npyio.NpzFile, pose: int) -> FittedResponse:
    found = {field.name: file[f"{field.name}_{pose}"] for field in fields(FittedResponse)[1:]}
    return FittedResponse(
        pose=pose - 1,
        joints=tuple(found.pop("joints").tolist()),
        payload=float(found.pop("payload")),
        degrees_of_freedom=float(found.pop("degrees_of_freedom")),
        **found,
    )
