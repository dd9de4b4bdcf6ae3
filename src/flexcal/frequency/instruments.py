"""The part of measured inputs that a reference explains, for responses in closed loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.frequency.local_windows import ORDER, LocalWindows, projected
from flexcal.frequency.record_spectra import RecordSpectra

_FREEDOM = 16
_CHUNK = 256


def with_reference(spectra: RecordSpectra, references: np.ndarray) -> RecordSpectra:
    """`spectra` whose instruments are what references (R, K, n_r) explain of the inputs, with the local polynomial method.

    Feedback puts the output's noise into the input, by which the response from that input is biased; the reference does not
    contain it (joint input-output method, in the two-stage form of Van den Hof and Schrama 1993). Raises `FlexcalError` where there are
    fewer references than inputs, or too few bins.
    """
    records, bins, n_u = spectra.inputs.shape
    n_r = references.shape[2]
    if n_r < n_u:
        raise FlexcalError(
            f"{n_r} references cannot explain {n_u} inputs; name one reference for each input."
        )
    unknowns = (ORDER + 1) * (n_r + records)
    window = (_FREEDOM + unknowns) // records + 1
    window += 1 - window % 2
    if window > bins:
        raise FlexcalError(f"{bins} bins are too few for {n_r} references; record longer, or more often.")
    explained = np.empty_like(spectra.inputs)
    for first in range(0, bins, _CHUNK):
        at = np.arange(first, min(first + _CHUNK, bins))
        explained[:, at] = _explained(spectra.inputs, references, at, window)
    return replace(spectra, instruments=explained * spectra.excited[:, None])


def _explained(inputs: np.ndarray, references: np.ndarray, at: np.ndarray, window: int) -> np.ndarray:
    """The fitted inputs (R, L, n_u) at the bins `at` (L,)."""
    records, bins, n_u = inputs.shape
    windows = LocalWindows.of(at, bins, window)
    smooth = windows.smooth
    seen_r, seen_u = windows.seen(references), windows.seen(inputs)
    scale = np.sqrt((np.abs(seen_r) ** 2).mean((1, 2)))[:, None, None, :] + np.finfo(float).tiny
    regressors = windows.regressors(seen_r / scale)
    rows, seen = (values - projected(smooth, values) for values in (regressors, seen_u))
    flat = rows.reshape(len(at), records * window, -1)
    solved = np.linalg.pinv(flat, rcond=1e-9) @ seen.reshape(len(at), records * window, n_u)
    rest = seen_u - regressors @ solved[:, None]
    fitted = regressors @ solved[:, None] + projected(smooth, rest)
    own = at[:, None] == windows.index
    return np.moveaxis((fitted * own[:, None, :, None]).sum(2), 0, 1)
