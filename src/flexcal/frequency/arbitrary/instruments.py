"""Instrumental variables: the part of measured inputs that a reference explains, for responses in closed loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.stats import f as fisher

from flexcal.errors import FlexcalError
from flexcal.frequency.arbitrary.spectra import RecordSpectra
from flexcal.frequency.periodic import ORDER, LocalWindows, projected

_FREEDOM = 16
_CHANCE = 1e-3
"""Significance level, at a bin, of the test that a reference has an effect."""
_CHUNK = 256
_DEGENERATE = 1e-9
"""Singular value, relative to the largest, below which references count as linearly dependent."""
_MOST_LEVERAGE = 0.9
_LEAST_SLOPE = 1e-3
"""Slope used where the references explain nothing."""


def with_reference(spectra: RecordSpectra, references: np.ndarray) -> tuple[RecordSpectra, np.ndarray]:
    """Spectra whose instruments are the part of the inputs explained by references (R, K, n_r), with the local polynomial method.

    Beside them (K,) whether that is more than chance (F-test of the local fit): where it is not, they are a part of the inputs' noise.

    Feedback puts the output's noise into the input, by which the response from that input is biased; the reference does not
    contain it (joint input-output method, in the two-stage form of Van den Hof and Schrama 1993). The fit at a bin leaves that bin out,
    else chance would put a part of its noise into the instrument (Angrist, Imbens and Krueger 1999). Raises `FlexcalError` where there are
    fewer references than inputs, or too few bins.
    """
    records, bins, n_u = spectra.inputs.shape
    n_r = references.shape[2]
    if n_r < n_u:
        raise FlexcalError(
            "E-FRF-003", f"{n_r} references cannot explain {n_u} inputs; name one reference for each input."
        )
    unknowns = (ORDER + 1) * (n_r + records)
    window = (_FREEDOM + unknowns) // records + 1
    window += 1 - window % 2
    if window > bins:
        raise FlexcalError(
            "E-FRF-004", f"{bins} bins are too few for {n_r} references; record longer, or more often."
        )
    explained, share = np.empty_like(spectra.inputs), np.empty(bins)
    for first in range(0, bins, _CHUNK):
        at = np.arange(first, min(first + _CHUNK, bins))
        explained[:, at], share[at] = _explained(spectra.inputs, references, at, window)
    taken = (ORDER + 1) * n_r
    left = records * (window - (ORDER + 1)) - taken
    ratio = share / taken / np.maximum((1.0 - share) / left, np.finfo(float).tiny)
    instruments = _shrunk(explained * spectra.excited[:, None], spectra.inputs, window)
    return replace(spectra, instruments=instruments), ratio > fisher.isf(_CHANCE, 2 * taken, 2 * left)


def _explained(
    inputs: np.ndarray, references: np.ndarray, at: np.ndarray, window: int
) -> tuple[np.ndarray, np.ndarray]:
    """Fitted inputs (R, L, n_u) at the bins `at` (L,), and the explained share (L,) of the power in the window."""
    records, bins, n_u = inputs.shape
    windows = LocalWindows.of(at, bins, window)
    smooth = windows.smooth
    seen_r, seen_u = windows.seen(references), windows.seen(inputs)
    scale = np.sqrt((np.abs(seen_r) ** 2).mean((1, 2)))[:, None, None, :] + np.finfo(float).tiny
    regressors = windows.regressors(seen_r / scale)
    rows, seen = (values - projected(smooth, values) for values in (regressors, seen_u))
    flat = rows.reshape(len(at), records * window, -1)
    basis, sizes, turned = np.linalg.svd(flat, full_matrices=False)
    known = sizes > _DEGENERATE * sizes[:, :1]
    basis = basis * known[:, None]
    target = seen.reshape(len(at), records * window, n_u)
    along = np.swapaxes(basis, -1, -2).conj() @ target
    scaled = along / np.where(known, sizes, 1.0)[:, :, None]
    solved = np.swapaxes(turned, -1, -2).conj() @ scaled
    fitted = regressors @ solved[:, None] + projected(smooth, seen_u - regressors @ solved[:, None])
    missed = np.abs(target - basis @ along) ** 2
    share = 1.0 - missed.sum((1, 2)) / np.maximum((np.abs(target) ** 2).sum((1, 2)), np.finfo(float).tiny)
    own = np.arange(len(at)), (windows.index == at[:, None]).argmax(1)
    leverage = (np.abs(basis) ** 2).sum(-1).reshape(len(at), records, window)[own[0], :, own[1]]
    leverage = np.minimum(leverage + (smooth[own[0], 0, own[1]] ** 2).sum(-1)[:, None], _MOST_LEVERAGE)[
        ..., None
    ]
    left_out = (fitted[own[0], :, own[1]] - leverage * seen_u[own[0], :, own[1]]) / (1.0 - leverage)
    return np.moveaxis(left_out, 0, 1), share


def _shrunk(instruments: np.ndarray, inputs: np.ndarray, window: int) -> np.ndarray:
    """Instruments (R, K, n_u) times the slope of the inputs by them in a window, which makes them uncorrelated with the rest."""
    products = np.real(instruments.conj() * inputs).sum(0), (np.abs(instruments) ** 2).sum(0)
    across, power = (uniform_filter1d(product, window, axis=0, mode="nearest") for product in products)
    return instruments * np.clip(across / np.maximum(power, np.finfo(float).tiny), _LEAST_SLOPE, 1.0)
