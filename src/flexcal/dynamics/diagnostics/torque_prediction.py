"""Measured and predicted torques, thinned for figures, and their spectra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.regression import regression_blocks
from flexcal.dynamics.signals import Experiment, Window

_LONGEST_SEGMENT = 512
_SEGMENTS = 4
"""Least number of adjacent segments of a recording for its spectra, unless it is very short."""
_SHORTEST_SEGMENT = 8
_APART = 1.5
"""Steps between rows above which there is a gap."""


@dataclass(frozen=True, eq=False)
class TorquePrediction:
    """Torques of one experiment: every `stride`-th row with its `time` (M,), s, `measured` and `predicted` (M, n), N m.

    Rows from `held_out_from` (s) on were not part of the fit. The power spectral densities `measured_density` and `residual_density`
    (F, n), (N m)²/Hz, at `frequencies_hz` (F,) are those of all rows, not of the thinned ones; F is 0 for a recording of fewer than 8 rows.
    """

    name: str
    stride: int
    time: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    held_out_from: float
    frequencies_hz: np.ndarray
    measured_density: np.ndarray
    residual_density: np.ndarray

    @property
    def held_out(self) -> np.ndarray:
        """Mask (M,) of rows excluded from the fit."""
        return self.time >= self.held_out_from


def predict_torques(
    observation: Observation,
    parameters: np.ndarray,
    experiment: Experiment,
    decimation: Decimation,
    *,
    held_out_from: float,
    points: int,
) -> TorquePrediction:
    """Torques of `parameters` (p,) in one more pass over an experiment, at most about so many `points` of each joint.

    Memory does not grow with the recording. Rows at standstill are in it too, as a figure over time has no gaps.
    """
    n = observation.model.n
    total = max(1, (experiment.samples - 2 * decimation.support - 1) // decimation.factor + 1)
    stride = -(-total // points)
    spectrum = _Spectrum(_segment(total))
    times, measured, predicted = [np.zeros(0)], [np.zeros((0, n))], [np.zeros((0, n))]
    step, before = np.nan, np.nan
    for block in regression_blocks(observation, experiment, decimation, Window()):
        steps = np.diff(np.concatenate([[before], block.time]))
        step = step if np.isfinite(step) else float(steps[-1])
        if steps[0] > _APART * step:
            spectrum.interrupt()
        before = float(block.time[-1])
        torque = block.torque[:n].T
        model = block.predicted(observation.column_indices, parameters)[:n].T
        spectrum.push(np.hstack([torque, torque - model]))
        kept = block.number % stride == 0
        times.append(block.time[kept])
        measured.append(torque[kept])
        predicted.append(model[kept])
    frequencies, density = spectrum.density(step, 2 * n)
    return TorquePrediction(
        experiment.name,
        stride,
        np.concatenate(times),
        np.concatenate(measured),
        np.concatenate(predicted),
        held_out_from,
        frequencies,
        density[:, :n],
        density[:, n:],
    )


def _segment(rows: int) -> int:
    """Length of a segment, a power of two."""
    length = min(_LONGEST_SEGMENT, max(_SHORTEST_SEGMENT, rows // _SEGMENTS))
    return 1 << (length.bit_length() - 1)


class _Spectrum:
    """Averaged periodograms of segments that overlap by half, less their means, under a Hann window (Welch 1967)."""

    def __init__(self, length: int) -> None:
        self._length = length
        self._window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length)
        self._pending: np.ndarray | None = None
        self._sum: np.ndarray | float = 0.0
        self._segments = 0

    def push(self, values: np.ndarray) -> None:
        """Add the next rows (M, k)."""
        pending = values if self._pending is None else np.concatenate([self._pending, values])
        while len(pending) >= self._length:
            part = pending[: self._length]
            lines = np.fft.rfft(self._window[:, None] * (part - part.mean(axis=0)), axis=0)
            self._sum = self._sum + np.abs(lines) ** 2
            self._segments += 1
            pending = pending[self._length // 2 :]
        self._pending = pending

    def interrupt(self) -> None:
        """Mark a gap before the next rows: no segment extends across it."""
        self._pending = None

    def density(self, step: float, width: int) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies (F,), Hz, and one-sided densities (F, k) of rows that are `step` (s) apart, without the mean at 0 Hz."""
        if not self._segments:
            return np.zeros(0), np.zeros((0, width))
        scale = 2.0 * step / (np.sum(self._window**2) * self._segments)
        density = scale * np.asarray(self._sum)
        density[-1] /= 2.0
        return np.fft.rfftfreq(self._length, step)[1:], density[1:]
