"""Measured and fitted frequency responses: fitted_responses.npz."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.files.formats import ArrayForm, NpzFile, write_npz
from flexcal.jobs.result_files.document import AGAIN
from flexcal.report.results import FittedResponse

FITTED = "fitted_responses.npz"

_SINGLE = {"complex128": np.complex64, "float64": np.float32}
"""Single precision, sufficient for figures."""


def write_fitted_responses(folder: Path, responses: Sequence[FittedResponse]) -> None:
    """Write `responses` to fitted_responses.npz in `folder`, atomically: the fields of `FittedResponse` as `<name>_<pose>`, poses from
    1, (L, n, n) and (L, S, n) arrays in single precision.
    """
    arrays: dict[str, np.ndarray] = {"pose": np.array([item.pose + 1 for item in responses])}
    for item in responses:
        for field in fields(item)[1:]:
            value = getattr(item, field.name)
            array = np.array(value, dtype=str) if isinstance(value, tuple) else np.asarray(value)
            small = array.astype(_SINGLE[array.dtype.name]) if array.ndim == 3 else array
            arrays[f"{field.name}_{item.pose + 1}"] = small
    write_npz(folder / FITTED, arrays)


def read_fitted_responses(folder: Path) -> tuple[FittedResponse, ...]:
    """Fitted responses from a file of `write_fitted_responses`; raises `InputError` if it is missing or invalid."""
    file = NpzFile(folder / FITTED, AGAIN)
    poses = file.read({"pose": ArrayForm("whole", ("poses",))})["pose"]
    return tuple(_response(file, pose) for pose in poses.tolist())


def _response(file: NpzFile, pose: int) -> FittedResponse:
    arrays = file.read({f"{name}_{pose}": form for name, form in _forms(pose).items()})
    values: dict[str, Any] = {name: arrays[f"{name}_{pose}"] for name in _forms(pose)}
    return FittedResponse(
        pose=pose - 1,
        joints=tuple(values.pop("joints").tolist()),
        sensors=tuple(values.pop("sensors").tolist()),
        sensor_units=tuple(values.pop("sensor_units").tolist()),
        payload=float(values.pop("payload")),
        degrees_of_freedom=float(values.pop("degrees_of_freedom")),
        **values,
    )


def _forms(pose: int) -> dict[str, ArrayForm]:
    lines, axes, sensors = f"lines {pose}", f"axes {pose}", f"sensors {pose}"
    matrices, sizes = ArrayForm("complex", (lines, axes, axes)), ArrayForm("real", (lines, axes, axes))
    return {
        "joints": ArrayForm("text", (axes,)),
        "q_mean": ArrayForm("real", ("joints",)),
        "payload": ArrayForm("real"),
        "frequencies_hz": ArrayForm("real", (lines,)),
        "response": matrices,
        "predicted": matrices,
        "std": sizes,
        "noise_std": sizes,
        "distortion_std": sizes,
        "misfit": ArrayForm("real", (axes, axes)),
        "degrees_of_freedom": ArrayForm("real"),
        "sensors": ArrayForm("text", (sensors,)),
        "sensor_units": ArrayForm("text", (sensors,)),
        "sensor_response": ArrayForm("complex", (lines, sensors, axes)),
        "sensor_predicted": ArrayForm("complex", (lines, sensors, axes)),
    }
