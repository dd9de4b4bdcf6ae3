"""Measured and predicted torques of identify dynamics and identify payload: predictions.npz."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.files.formats import ArrayForm, NpzFile, write_npz
from flexcal.jobs.result_files.document import AGAIN

PREDICTIONS = "predictions.npz"
_ARRAYS = ("time", "measured", "predicted", "frequencies_hz", "measured_density", "residual_density")
_KIND = {"time": np.float64}
"""Types of arrays that differ from single precision, which is enough for plotted torques; times mark the held-out part."""


def write_predictions(folder: Path, predictions: Sequence[TorquePrediction]) -> None:
    """Write `predictions`, one per log, to `folder`, atomically: arrays `<name>_<k>` of log k, counted from 0."""
    arrays = {
        "names": np.array([log.name for log in predictions]),
        "strides": np.array([log.stride for log in predictions]),
        "held_out_from": np.array([log.held_out_from for log in predictions]),
    }
    for k, log in enumerate(predictions):
        arrays |= {
            f"{name}_{k}": np.asarray(getattr(log, name), _KIND.get(name, np.float32)) for name in _ARRAYS
        }
    write_npz(folder / PREDICTIONS, arrays)


def read_predictions(folder: Path) -> tuple[TorquePrediction, ...]:
    """Torque predictions from a file of `write_predictions`; raises `InputError` if it is missing or invalid."""
    file = NpzFile(folder / PREDICTIONS, AGAIN)
    logs = file.read(
        {
            "names": ArrayForm("text", ("logs",)),
            "strides": ArrayForm("whole", ("logs",)),
            "held_out_from": ArrayForm("real", ("logs",), finite=False),
        }
    )
    return tuple(
        TorquePrediction(
            name=str(name),
            stride=int(logs["strides"][k]),
            held_out_from=float(logs["held_out_from"][k]),
            **{array: arrays[f"{array}_{k}"] for array in _ARRAYS},
        )
        for k, name in enumerate(logs["names"])
        for arrays in [file.read({f"{array}_{k}": form for array, form in _forms(k).items()})]
    )


def _forms(log: int) -> dict[str, ArrayForm]:
    torques = ArrayForm("real", (f"rows {log}", "joints"))
    densities = ArrayForm("real", (f"frequencies {log}", "joints"))
    return {
        "time": ArrayForm("real", (f"rows {log}",)),
        "measured": torques,
        "predicted": torques,
        "frequencies_hz": ArrayForm("real", (f"frequencies {log}",)),
        "measured_density": densities,
        "residual_density": densities,
    }
