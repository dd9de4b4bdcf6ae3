"""Frequency responses by the local polynomial method for arbitrary excitation, and by Welch's averaged periodograms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.frequency.arbitrary.spectra import RecordSpectra
from flexcal.frequency.periodic import ORDER, LocalWindows, kronecker, projected

_FREEDOM = 12
"""Least degrees of freedom of the scatter in a window."""
_MOST_LINES = 1500
_CHUNK = 256
_DEGENERATE, _MOST_DEGENERATE = 1e-9, 0.9
"""Diagonal of R, relative to its largest, below which regressors count as dependent, and largest share of such lines."""
_UNKNOWN = 1e30
"""Relative variance assigned to a response that the data do not determine."""


@dataclass(frozen=True, eq=False)
class LocalResponse:
    """G (L, n_y, n_u) from inputs to accelerations at `frequencies_hz` (L,), and its uncertainty.

    covariance (L, n_y n_u, n_y n_u) of vec G (column-major), complex and Hermitian; scatter (L, n_y, n_y): covariance of the outputs
    about G U, with `degrees_of_freedom`; coherence (L, n_y): multiple coherence of an output with all inputs. Lines closer than
    `correlated_hz` share data, so their errors are correlated. `method` names the estimator.
    """

    frequencies_hz: np.ndarray
    response: np.ndarray
    covariance: np.ndarray
    scatter: np.ndarray
    coherence: np.ndarray
    degrees_of_freedom: float
    correlated_hz: float
    method: str

    @property
    def std(self) -> np.ndarray:
        """Standard deviation (L, n_y, n_u) of every element, the root of E|δ|²."""
        lines, outputs, inputs = self.response.shape
        variance = np.real(np.diagonal(self.covariance, axis1=1, axis2=2)).reshape(lines, inputs, outputs)
        return np.sqrt(np.maximum(np.swapaxes(variance, 1, 2), 0.0))


def local_response(spectra: RecordSpectra, noise: np.ndarray | None = None) -> LocalResponse:
    """Frequency response by the local polynomial method (Pintelon and Schoukens 2012, ch. 7), from records with transients.

    In a window of bins d about a line, all records share G: Y = (G_0 + G_1 d + G_2 d²) U + T_0 + T_1 d + T_2 d² + V, with a transient T of
    each record and output. The regressors are the instruments. `noise` (K,): shape over frequency of the standard deviation of V, where it
    is not flat in a window; the equations are divided by it. Raises `FlexcalError` where there are too few bins, or
    where the inputs cannot be told apart.
    """
    lines = np.flatnonzero(spectra.excited)
    window = local_window(spectra)
    at = lines[:: _stride(len(lines))]
    weighted = spectra if noise is None else spectra.divided(noise)
    parts = [_windows(weighted, chunk, window) for chunk in _chunks(at)]
    response, gain, scatter, power = (
        np.concatenate(part) for part in zip(*(p[:4] for p in parts), strict=True)
    )
    relative = scatter
    if noise is not None:
        size = noise[at] ** 2
        scatter, power = scatter * size[:, None, None], power * size[:, None]
    total = power + np.real(np.diagonal(scatter, axis1=1, axis2=2))
    return LocalResponse(
        frequencies_hz=spectra.frequencies_hz[at],
        response=response,
        covariance=kronecker(gain, relative),
        scatter=scatter,
        coherence=power / np.maximum(total, np.finfo(float).tiny),
        degrees_of_freedom=min(float(part[4]) for part in parts),
        correlated_hz=window * spectra.resolution_hz,
        method="local_polynomial",
    )


def local_window(spectra: RecordSpectra) -> int:
    """Number of bins in a window of the local polynomial method, odd: enough for the degrees of freedom.

    Raises `FlexcalError` where there are too few bins.
    """
    records, bins, n_u = spectra.inputs.shape
    lines = int(spectra.excited.sum())
    share = lines / bins
    unknowns = (ORDER + 1) * n_u
    least = (ORDER + 1) * (n_u + 1) + 2  # a transient and equal inputs in all records must differ
    for window in range(least + 1 - least % 2, bins + 1, 2):
        if records * share * (window - (ORDER + 1)) - unknowns >= _FREEDOM and window * share >= 3:
            return min(max(window, 2 * _stride(lines) + 1), bins - 1 + bins % 2)
    raise FlexcalError(
        "E-FRF-005",
        f"a frequency response needs more excited lines than {lines} (records: {records}, inputs: {n_u}); record longer, or more often.",
    )


def _stride(lines: int) -> int:
    return max(1, -(-lines // _MOST_LINES))


def _chunks(at: np.ndarray) -> Iterator[np.ndarray]:
    for first in range(0, len(at), _CHUNK):
        yield at[first : first + _CHUNK]


def _windows(
    spectra: RecordSpectra, at: np.ndarray, window: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Response, right factor of its covariance, scatter, explained output power, and degrees of freedom, at the bins `at`."""
    records, bins, n_u = spectra.inputs.shape
    n_y, lines = spectra.outputs.shape[2], len(at)
    windows = LocalWindows.of(at, bins, window)
    seen = windows.seen
    smooth = windows.smooth[..., : 0 if spectra.settled else None]

    def without_transient(values: np.ndarray) -> np.ndarray:
        return values - projected(smooth, values)

    instruments = seen(spectra.instruments)
    scale = np.sqrt((np.abs(instruments) ** 2).mean((1, 2)))[:, None, None, :]
    if not (scale > 0).all():
        raise FlexcalError(
            "E-FRF-006",
            "an input does not move at all at some frequencies; leave that column out with --input.",
        )
    regressors = without_transient(windows.regressors(instruments / scale)).reshape(
        lines, records * window, -1
    )
    columns = without_transient(np.concatenate([seen(spectra.outputs), seen(spectra.inputs)], -1)).reshape(
        lines, records * window, n_y + n_u
    )
    q, r = np.linalg.qr(regressors)
    diagonal = np.abs(np.diagonal(r, axis1=-2, axis2=-1))
    degenerate = diagonal.min(-1) < _DEGENERATE * diagonal.max(-1)
    if degenerate.mean() > _MOST_DEGENERATE:
        raise FlexcalError(
            "E-FRF-007",
            "the inputs cannot be told apart at most frequencies; record as many experiments with different excitation as there are "
            "inputs, or name one of them with --input.",
        )
    r = np.where(degenerate[:, None, None], np.eye(r.shape[-1]), r)
    coefficients = np.swapaxes(q, -1, -2).conj() @ columns
    inverse = np.linalg.solve(r, np.broadcast_to(np.eye(r.shape[-1]), r.shape))[:, :n_u]
    local = np.swapaxes(inverse @ coefficients / scale[:, 0, 0, :, None], -1, -2)  # (L, n_y + n_u, n_u)
    local[degenerate, :n_y], local[degenerate, n_y:] = 0.0, np.eye(n_u)
    to_input = np.linalg.inv(local[:, n_y:])
    response = local[:, :n_y] @ to_input
    root = np.swapaxes(to_input, -1, -2) @ (inverse / scale[:, 0, 0, :, None])
    gain = root @ np.swapaxes(root, -1, -2).conj()
    gain[degenerate] = _UNKNOWN * np.eye(n_u)
    residual = columns - q @ coefficients
    error = residual[:, :, :n_y] - residual[:, :, n_y:] @ np.swapaxes(response, -1, -2)
    carried = np.broadcast_to(spectra.excited[windows.index][:, None], (lines, records, window)).reshape(
        lines, -1
    )
    error = error * carried[:, :, None]
    count = carried.sum(1)
    freedom = count * (1 - (ORDER + 1) / window) - regressors.shape[-1]
    scatter = np.swapaxes(error, -1, -2) @ error.conj() / freedom[:, None, None]
    fitted = (seen(spectra.inputs) * seen(spectra.excited[None, :, None])) @ np.swapaxes(response, -1, -2)[
        :, None
    ]
    power = (np.abs(fitted) ** 2).sum((1, 2)) / count[:, None]
    return response, gain, scatter, power, float(freedom.min())
