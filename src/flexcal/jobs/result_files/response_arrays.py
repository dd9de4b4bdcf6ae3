"""response.npz: a response measured without a plan, with the responses of its fits."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.files.formats import ArrayForm, NpzFile
from flexcal.files.transaction import atomic_path
from flexcal.frequency.arbitrary import LocalResponse

RESPONSE = "response.npz"


def write_response_arrays(
    folder: Path, response: LocalResponse, modal: np.ndarray, masses: np.ndarray
) -> None:
    """Write the response, that of the modal model (L, n_y, n_u) and that of the masses (L,), empty where there are none, atomically."""
    with atomic_path(folder / RESPONSE) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(
            stream,
            frequencies_hz=response.frequencies_hz,
            response=response.response,
            covariance=response.covariance,
            coherence=response.coherence,
            std=response.std,
            modal=modal,
            masses=masses,
        )


def read_response_arrays(folder: Path) -> dict[str, np.ndarray]:
    """What `write_response_arrays` left, without the covariance; raises `InputError` where the file is not there or not such a one."""
    file = NpzFile(folder / RESPONSE, "run 'flexcal identify response' again")
    matrix = ("lines", "outputs", "inputs")
    return file.read(
        {
            "frequencies_hz": ArrayForm("real", ("lines",)),
            "response": ArrayForm("complex", matrix),
            "std": ArrayForm("real", matrix),
            "coherence": ArrayForm("real", ("lines", "outputs")),
            "modal": ArrayForm("complex", matrix),
            "masses": ArrayForm("complex", ("lines of masses",)),
        }
    )
