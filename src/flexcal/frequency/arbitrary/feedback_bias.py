"""Share of the input that a controller feeds back from output noise, and the resulting bias of the response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.frequency.arbitrary.excitation_record import ExcitationRecord
from flexcal.frequency.arbitrary.spectra import HIGHEST

_MEMORY = 160
"""Largest number of lags of the autoregressive model."""
_SAMPLES = 12
"""Least number of samples per coefficient of the model."""
_LEAST = 10
_RIDGE = 1e-13
"""Ridge, relative to the mean of the diagonal: periodic and swept excitations predict themselves with coefficients of any size."""
_GRID, _LOWEST = 400, 5e-4
_ACTS = 0.3
"""Share of the input, averaged over any third of an octave, from which feedback counts as acting; below 0.1 in open loop."""
_THIRD = 0.23
_NEARLY_ALL, _BEYOND = 0.999, 1.5
"""Share of the inputs' power that defines its highest frequency, and factor on that beyond which there is none."""


@dataclass(frozen=True, eq=False)
class Feedback:
    """Share of fed-back noise in the power of the input at `frequencies_hz` (F,): `share` (F,), the largest of all inputs.

    `bias` (F, n_y, n_u), relative and complex, is that of a response that takes the inputs as free of it; `power` (F,) is the spectral
    density of the inputs, each relative to its variance.
    """

    frequencies_hz: np.ndarray
    share: np.ndarray
    bias: np.ndarray
    power: np.ndarray

    @property
    def acts(self) -> bool:
        """Whether a controller acts on the outputs at any frequency up to 0.4 of the sampling rate.

        Where the inputs leave an octave or more without power, by what it does there: friction lets an axis tell how a sweep goes on,
        but not beyond it.
        """
        log = np.log(self.frequencies_hz)
        cumulative_power = np.cumsum(self.power * np.gradient(self.frequencies_hz))
        end = self.frequencies_hz[int(np.searchsorted(cumulative_power, _NEARLY_ALL * cumulative_power[-1]))]
        beyond = self.frequencies_hz > _BEYOND * end
        if 2.0 * _BEYOND * end > self.frequencies_hz[-1]:
            beyond[:] = True
        near = (np.abs(log - log[:, None]) < 0.5 * _THIRD) & beyond
        return bool(((near @ self.share) / np.maximum(near.sum(1), 1)).max() > _ACTS)

    def share_at(self, frequencies_hz: np.ndarray) -> np.ndarray:
        """Share (L,) at other frequencies, interpolated."""
        return np.interp(frequencies_hz, self.frequencies_hz, self.share)

    def bias_at(self, frequencies_hz: np.ndarray) -> np.ndarray:
        """|bias| (L,) of the worst element at other frequencies, interpolated."""
        return np.interp(frequencies_hz, self.frequencies_hz, np.abs(self.bias).max((1, 2)))


def feedback(pieces: Sequence[ExcitationRecord], at_once: Sequence[bool]) -> Feedback | None:
    """Feedback by a vector autoregressive model of inputs and outputs (Geweke 1982); None for records that are too short.

    An output may act on the input of the same sample, but the input acts on the outputs of later ones alone, except on those that follow it
    `at_once` (n_y,), as accelerations do; of these only earlier samples can be fed back. With the innovations of the outputs e and of the
    inputs r, u = H_ue e + H_ur r and y = H_ye e + H_yr r, the response is H_yr H_ur⁻¹, and that from spectra S_yu S_uu⁻¹.
    """
    n_y, n_u = pieces[0].outputs.shape[1], pieces[0].inputs.shape[1]
    width = n_y + n_u
    samples = sum(len(piece) for piece in pieces)
    shortest = min(len(piece) for piece in pieces)
    lags = min(_MEMORY, samples // (_SAMPLES * width), shortest // 4)
    if lags < _LEAST:
        return None
    signals = [np.hstack([piece.outputs, piece.inputs]) for piece in pieces]
    scale = np.sqrt(np.mean([signal.var(0) for signal in signals], axis=0))
    if not (scale > 0).all():
        return None
    products = np.sum([_products((signal - signal.mean(0)) / scale, lags) for signal in signals], axis=0)
    now = products[:, 0, :, 0]
    past = products[:, 1:, :, 1:].reshape(width * lags, -1)
    between = products[:, 1:, :, 0].reshape(width * lags, -1)
    past = past + _RIDGE * np.trace(past) / len(past) * np.eye(len(past))
    coefficients = np.linalg.solve(past, between)
    innovations = (now - between.T @ coefficients) / max(1, samples - len(pieces) * lags - width * lags)
    instant = np.zeros((width, width))  # of the outputs on the inputs of the same sample
    known = np.flatnonzero(~np.asarray(at_once, dtype=bool))
    if known.size:
        instant[n_y:, known] = np.linalg.solve(
            innovations[np.ix_(known, known)], innovations[np.ix_(known, np.arange(n_y, width))]
        ).T
    own = np.eye(width) - instant
    noise = own @ innovations @ own.T
    grid = np.geomspace(_LOWEST, HIGHEST, _GRID)
    delays = np.exp(-2j * np.pi * grid[:, None] * np.arange(1, lags + 1))
    memory = np.einsum("fl,ilj->fji", delays, coefficients.reshape(width, lags, width))
    transfer = np.linalg.inv(own @ (np.eye(width) - memory))
    from_noise, from_input = transfer[:, :, :n_y], transfer[:, :, n_y:]
    fed = _power(from_noise, noise[:n_y, :n_y])
    whole = fed + _power(from_input, noise[n_y:, n_y:])
    share = np.real(np.diagonal(fed, axis1=1, axis2=2) / np.diagonal(whole, axis1=1, axis2=2))[:, n_y:].max(1)
    response = from_input[:, :n_y] @ np.linalg.inv(from_input[:, n_y:])
    direct = whole[:, :n_y, n_y:] @ np.linalg.inv(whole[:, n_y:, n_y:])
    power = np.real(np.trace(whole[:, n_y:, n_y:], axis1=1, axis2=2))
    return Feedback(grid / pieces[0].time_step, share, direct / response - 1.0, power)


def _power(transfer: np.ndarray, noise: np.ndarray) -> np.ndarray:
    return transfer @ noise @ np.swapaxes(transfer, 1, 2).conj()


def _products(signal: np.ndarray, lags: int) -> np.ndarray:
    """Σ_t x_i(t - a) x_j(t - b) (c, lags + 1, c, lags + 1) of a signal (N, c), over t from `lags` on.

    Of every pair of lags by adding to and taking from that of the lags before what enters and leaves the sum.
    """
    count, channels = signal.shape
    products = np.empty((channels, lags + 1, channels, lags + 1))
    latest = signal[lags:]
    for b in range(lags + 1):
        edge = latest.T @ signal[lags - b : count - b]
        products[:, 0, :, b], products[:, b, :, 0] = edge, edge.T
    for a in range(1, lags + 1):
        enters = signal[lags - a][:, None, None] * signal[lags - 1 :: -1][:lags].T
        leaves = signal[count - a][:, None, None] * signal[count - 1 : count - 1 - lags : -1].T
        products[:, a, :, 1:] = products[:, a - 1, :, :-1] + enters - leaves
    return products
