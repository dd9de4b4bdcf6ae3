"""Measured and predicted torques of identify dynamics and identify payload: predictions.npz."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexcal.atomic import atomic_path
from flexcal.dynamics import TorquePrediction
from flexcal.errors import InputError

PREDICTIONS = "predictions.npz"
_ARRAYS = ("time", "measured", "predicted", "frequencies_hz", "measured_density", "residual_density")
_KIND = {"time": np.float64}
"""Torques are drawn, so four bytes each are enough; times tell what was held out."""


def write_predictions(folder: Path, predictions: Sequence[TorquePrediction]) -> None:
    """Leave `predictions`, one a log, in `folder`, atomically: arrays `<name>_<k>` of log k, counted from 0."""
    arrays = {
        "names": np.array([log.name for log in predictions]),
        "strides": np.array([log.stride for log in predictions]),
        "held_out_from": np.array([log.held_out_from for log in predictions]),
    }
    for k, log in enumerate(predictions):
        arrays |= {
            f"{name}_{k}": np.asarray(getattr(log, name), _KIND.get(name, np.float32)) for name in _ARRAYS
        }
    with atomic_path(folder / PREDICTIONS) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def read_predictions(folder: Path) -> tuple[TorquePrediction, ...]:
    """What `write_predictions` left; raises `InputError` where the file is not there or not such a one."""
    path = folder / PREDICTIONS
    try:
        with np.load(path) as file:
            return tuple(
                TorquePrediction(
                    name=str(name),
                    stride=int(file["strides"][k]),
                    held_out_from=float(file["held_out_from"][k]),
                    **{array: file[f"{array}_{k}"] for array in _ARRAYS},
                )
                for k, name in enumerate(file["names"])
            )
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        raise InputError(
            f"{path} cannot be read ({problem}); run the verb that writes it again."
        ) from problem
