"""File response.npz: a response measured without a plan, with the responses of its fits."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.files.formats import ArrayForm, NpzFile, write_npz
from flexcal.frequency.arbitrary import LocalResponse

RESPONSE = "response.npz"


def write_response_arrays(
    folder: Path, response: LocalResponse, modal: np.ndarray, masses: np.ndarray
) -> None:
    """Write the response, that of the modal model (L, n_y, n_u) and that of the masses (L,), empty if there are none, atomically."""
    names = ("frequencies_hz", "response", "covariance", "coherence", "std")
    arrays = {name: getattr(response, name) for name in names}
    write_npz(folder / RESPONSE, arrays | {"modal": modal, "masses": masses})


def read_response_arrays(folder: Path) -> dict[str, np.ndarray]:
    """Responses from a file of `write_response_arrays`, without the covariance; raises `InputError` if it is missing or invalid."""
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
