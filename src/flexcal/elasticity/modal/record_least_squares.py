"""Least-squares fit of a response to the spectra of whole records, with the transient of each record eliminated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexcal.frequency.arbitrary import RecordSpectra
from flexcal.frequency.periodic import pool_noise

CLUSTERS = 8
"""Number of records from which the scatter between them gives the covariance."""
_POOLED = 24
"""Approximate number of phasors of all records that share a variance, and so degrees of freedom of a parameter that few bins determine."""
_MOST_LEVERAGE = 0.8


@dataclass(frozen=True, eq=False)
class BandData:
    """Spectra in a band, and the standard deviation of every output at every bin, `sigma` (K, n_y).

    x (K,) is jω over ω at the band's end, `highest` rad/s: the variable of all fits.
    """

    spectra: RecordSpectra
    sigma: np.ndarray

    @property
    def highest(self) -> float:
        return float(2 * np.pi * self.spectra.frequencies_hz[-1])

    @property
    def x(self) -> np.ndarray:
        return 1j * self.spectra.frequencies_hz / self.spectra.frequencies_hz[-1]

    @property
    def rows(self) -> int:
        """Number of fitted real values."""
        return 2 * self.spectra.outputs.size


@dataclass(frozen=True, eq=False)
class Projection:
    """Projector (per output) that removes the transients of given poles from whitened spectra.

    `basis` (n_y, 2K, T): orthonormal columns.
    """

    basis: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, data: BandData, transient: np.ndarray) -> Projection:
        """Projection for `transient` (n_y, K, T), whose real combinations are the transients."""
        weight = np.sqrt(2.0) / data.sigma.T  # (n_y, K): σ² is that of both parts together
        stacked = stack(transient * weight[:, :, None])
        if not transient.shape[2]:
            return cls(stacked, weight)
        scale = np.linalg.norm(stacked, axis=1, keepdims=True)
        return cls(np.linalg.qr(stacked / scale)[0], weight)

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Whitened real rows (R, n_y, 2K, c) of complex values (R, n_y, K, c), less the transient."""
        real = stack(values * self.weight[None, :, :, None])
        return real - self.basis @ (np.swapaxes(self.basis, -1, -2) @ real)


SMOOTH = 5
"""Number of terms of a transient besides those of the modes."""


def transient_basis(data: BandData, slow: float, of: np.ndarray) -> np.ndarray:
    """Basis (n_y, K, T) of the spectra of free motion at both ends of a record, as accelerations.

    Of every mode x² + c_1 x + c_0 (rows of `of`) a sampled decaying oscillation, of the rigid body an offset, a drift and a motion that
    friction stops, with the pole x = -`slow`, and two single samples.
    """
    s = data.spectra
    if s.settled:
        return np.empty((s.factor.shape[1], len(s.frequencies_hz), 0))
    delayed = np.exp(-2j * np.pi * s.frequencies_hz * s.time_step)  # z⁻¹
    steps = 1.0 / (1.0 - delayed)
    stopped = 1.0 / (1.0 - np.exp(-slow * data.highest * s.time_step) * delayed)
    columns = [np.ones_like(delayed), delayed, steps, steps**2, stopped]
    for c1, c0 in of:
        pole = np.roots([1.0, c1, c0])[0] * data.highest
        sampled = np.exp(pole * s.time_step)
        mode = 1.0 / (1.0 - 2.0 * sampled.real * delayed + abs(sampled) ** 2 * delayed**2)
        columns += [mode, delayed * mode]
    return s.factor.T[:, :, None] * np.stack(columns, -1)


def transients(data: BandData, basis: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Transients (R, K, n_y) in `rest` (R, K, n_y), real combinations of `basis` (n_y, K, T), by weighted least squares."""
    result = np.empty_like(rest)
    for y in range(rest.shape[2]):
        weight = 1.0 / data.sigma[:, y, None]
        rows = stack(basis[y] * weight)
        scale = np.linalg.norm(rows, axis=0)
        seen = stack(rest[:, :, y].T * weight)
        solved = (
            np.linalg.lstsq(rows / scale, seen, rcond=1e-12)[0] / scale[:, None]
            if scale.size
            else scale[:, None]
        )
        result[:, :, y] = (basis[y] @ solved).T
    return result


def stack(values: np.ndarray) -> np.ndarray:
    """Real and imaginary parts of (…, K, c) as rows (…, 2K, c)."""
    return np.concatenate([np.real(values), np.imag(values)], axis=-2)


def thinned(data: BandData, most: int) -> BandData:
    """Every n-th bin, so that all records together have at most `most`; no thinning for an excitation with gaps."""
    records, bins, _ = data.spectra.inputs.shape
    every = max(1, records * bins // most)
    if every == 1 or not data.spectra.excited.all():
        return data
    s = data.spectra
    kept = slice(None, None, every)
    return BandData(
        replace(
            s,
            frequencies_hz=s.frequencies_hz[kept],
            inputs=s.inputs[:, kept],
            outputs=s.outputs[:, kept],
            instruments=s.instruments[:, kept],
            excited=s.excited[kept],
            factor=s.factor[kept],
        ),
        data.sigma[kept],
    )


def pooled_covariance(errors: np.ndarray, excited: np.ndarray) -> np.ndarray:
    """Covariance (K, n_y, n_y) of errors (R, K, n_y) pooled over records and neighbouring bins of the same kind (excited or not)."""
    records, bins, _ = errors.shape
    squares = np.einsum("rki,rkj->kij", errors, errors.conj()) / records
    pooled = np.empty_like(squares)
    index = np.arange(bins)
    for kind in (True, False):
        own = index[excited == kind]
        if own.size:
            count = min(own.size, max(5, -(-_POOLED // records)))
            pooled[own] = pool_noise(squares[own], own, own, count)
    return pooled


def _unshrunk(errors: np.ndarray, rows: np.ndarray, bread: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Errors (R, n_y, 2K) over √(1 - h), with h the leverage of a bin in the fit of parameters and transients."""
    own = np.einsum("rykp,pq,rykq->ryk", rows, bread, rows, optimize=True)
    leverage = own + (basis**2).sum(2)
    half = leverage.shape[2] // 2
    mean = 0.5 * (leverage[:, :, :half] + leverage[:, :, half:])
    return errors / np.sqrt(1.0 - np.minimum(np.concatenate([mean, mean], axis=2), _MOST_LEVERAGE))


@dataclass(frozen=True, eq=False)
class FitCovariance:
    """Covariance of parameters, that for correct weights and model (`likelihood`), and degrees of freedom for intervals."""

    covariance: np.ndarray
    likelihood: np.ndarray
    degrees_of_freedom: float


def sandwich(
    rows: np.ndarray, errors: np.ndarray, excited: np.ndarray, projection: Projection, prior: np.ndarray
) -> FitCovariance:
    """Covariance of least-squares parameters from whitened, projected Jacobian rows (R, n_y, 2K, p) and errors (R, n_y, 2K).

    From `CLUSTERS` records on the scatter of the scores between records decides, which needs no model of the noise, and what all
    records leave alike; with fewer, errors are
    taken as independent between bins, correlated between outputs, and as large as their neighbours'. They are
    corrected for the share that the fit took from each bin. `prior` (p,): information known beforehand.
    """
    records, _, count, _ = rows.shape
    information = np.einsum("rykp,rykq->pq", rows, rows, optimize=True) + np.diag(prior)
    bread = np.linalg.pinv(information, rcond=1e-13, hermitian=True)
    half = count // 2
    whole = _unshrunk(errors, rows, bread, projection.basis)
    complex_errors = np.moveaxis(whole[:, :, :half] + 1j * whole[:, :, half:], 1, 2)
    complex_rows = rows[:, :, :half] + 1j * rows[:, :, half:]  # (R, n_y, K, p)
    if records >= CLUSTERS:
        scores = np.einsum("rykp,ryk->rp", rows, errors, optimize=True)
        scores = scores - scores.mean(0)
        meat = scores.T @ scores * records / (records - 1)
        meat = meat + _common(complex_rows, complex_errors, excited)
        freedom = records - 1.0
    else:
        noise = pooled_covariance(complex_errors, excited)
        meat = 0.5 * np.real(
            np.einsum("rikp,kij,rjkq->pq", complex_rows.conj(), noise, complex_rows, optimize=True)
        )
        freedom = float(_POOLED)
    return FitCovariance(bread @ (meat + np.diag(prior)) @ bread, bread, freedom)


def _common(rows: np.ndarray, errors: np.ndarray, excited: np.ndarray) -> np.ndarray:
    """Covariance of the scores due to residuals common to all records: model errors, which repetitions do not average.

    From complex rows (R, n_y, K, p) and errors (R, K, n_y): their mean over records beyond what their scatter explains.
    """
    records = len(errors)
    mean = errors.mean(0, keepdims=True)
    alike = pooled_covariance(mean, excited)
    chance = pooled_covariance(errors - mean, excited) / (records - 1)
    total, expected = (np.real(np.trace(values, axis1=1, axis2=2)) for values in (alike, chance))
    share = np.clip(1.0 - expected / np.maximum(total, np.finfo(float).tiny), 0.0, 1.0)
    summed = rows.sum(0)
    return 0.5 * np.real(
        np.einsum("ikp,kij,jkq->pq", summed.conj(), alike * share[:, None, None], summed, optimize=True)
    )


Residual = Callable[[np.ndarray], np.ndarray]


def jacobian(residual: Residual, at: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Central differences of a residual (…) with respect to parameters of order one, (…, p)."""
    columns = []
    for index in range(at.size):
        moved = np.zeros_like(at)
        moved[index] = step
        columns.append((residual(at + moved) - residual(at - moved)) / (2 * step))
    return np.stack(columns, -1)
