"""Spectra of whole records, with the data that transient and feedback corrections need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.frequency.arbitrary.excitation_record import Channel, ExcitationRecord
from flexcal.frequency.periodic import hold_factor

Hold = Literal["held", "instantaneous", "mean"]
HIGHEST = 0.4
"""Highest frequency, relative to the sampling rate: above it a sampled signal says little about a continuous one."""
_CARRIED, _NEIGHBOURS = 0.01, 10
"""Power of a harmonic, relative to the strongest of this many neighbours on either side, above which it counts as excited."""
_REST, _LEAST_REST, _STILL = 0.05, 5, 0.02
"""Final share of a record and samples at its ends that are tested for rest, and the motion allowed, relative to the largest."""
_LOWEST = 2
"""First bin used: below it drift and offset dominate."""


@dataclass(frozen=True, eq=False)
class RecordSpectra:
    """Phasors of R records at K bins: `inputs` (R, K, n_u), and `outputs` (R, K, n_y) as accelerations.

    `instruments` (R, K, n_u) is the part of the inputs that is taken as free of the output's noise: the inputs themselves in open loop,
    their periodic part where the excitation is periodic, what a reference explains of them where there is one. `excited` (K,) are the bins
    that carry it: all of them, or the harmonics of `periods` whole periods. factor (K, n_y): from the recorded outputs to accelerations.
    time_step s; resolution_hz: distance of the bins of whole
    records; settled: whether the records begin and end at rest, so that there are no transients.
    """

    frequencies_hz: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray
    instruments: np.ndarray
    excited: np.ndarray
    factor: np.ndarray
    time_step: float
    resolution_hz: float
    settled: bool = False
    periods: int | None = None

    def of_records(self, part: slice) -> RecordSpectra:
        """Spectra of some of the records."""
        return replace(
            self, inputs=self.inputs[part], outputs=self.outputs[part], instruments=self.instruments[part]
        )

    def divided(self, by: np.ndarray) -> RecordSpectra:
        """Spectra with all phasors divided by positive numbers `by` (K,) of their bins."""
        over = by[:, None]
        return replace(
            self, inputs=self.inputs / over, outputs=self.outputs / over, instruments=self.instruments / over
        )

    def between(self, low_hz: float, high_hz: float) -> RecordSpectra:
        """Spectra at the bins of a band."""
        tolerance = 1e-6 * self.resolution_hz
        kept = (self.frequencies_hz >= low_hz - tolerance) & (self.frequencies_hz <= high_hz + tolerance)
        return replace(
            self,
            frequencies_hz=self.frequencies_hz[kept],
            inputs=self.inputs[:, kept],
            outputs=self.outputs[:, kept],
            instruments=self.instruments[:, kept],
            excited=self.excited[kept],
            factor=self.factor[kept],
        )


def record_spectra(
    pieces: Sequence[ExcitationRecord],
    inputs: Sequence[Channel],
    outputs: Sequence[Channel],
    *,
    hold: Hold = "held",
    period: int | None = None,
) -> tuple[RecordSpectra, np.ndarray]:
    """Spectra of records of equal length, and those of their references (R, K, n_r) at the same bins.

    Of a periodic excitation the last whole periods are taken, of three and more without the first. Inputs are corrected
    for the hold of a sample.
    """
    step, size = pieces[0].time_step, len(pieces[0])
    periods = size // period if period else None
    if periods and periods > 2:
        periods -= 1
    first = size - periods * period if period and periods else 0
    frequencies = np.fft.rfftfreq(size - first, step)
    kept = slice(_LOWEST, int(np.searchsorted(frequencies, HIGHEST / step)))
    frequencies = frequencies[kept]
    omega = 2 * np.pi * frequencies

    def spectra(values: Sequence[np.ndarray]) -> np.ndarray:
        stacked = np.stack([value[first:] - value[first:].mean(0) for value in values])
        return np.fft.rfft(stacked, axis=1)[:, kept] * (2.0 / (size - first))

    u = spectra([piece.inputs for piece in pieces]) * hold_factor(hold, omega, step)[:, None]
    factor = np.stack([(1j * omega) ** (2 - channel.derivative) for channel in outputs], -1)
    y = spectra([piece.outputs for piece in pieces]) * factor
    r = spectra([piece.references for piece in pieces])
    excited = np.ones(len(frequencies), bool)
    instruments = u
    if periods:
        excited = _carrying(u, (np.arange(len(frequencies)) + _LOWEST) % periods == 0)
        instruments = u * excited[:, None]
    measured = RecordSpectra(
        frequencies_hz=frequencies,
        inputs=u,
        outputs=y,
        instruments=instruments,
        excited=excited,
        factor=factor,
        time_step=step,
        resolution_hz=1.0 / (step * (size - first)),
        settled=all(_is_settled(piece) for piece in pieces),
        periods=periods,
    )
    return measured, r


def _is_settled(piece: ExcitationRecord) -> bool:
    """Whether input and outputs have the same level at the beginning and at the end, as in an impact test."""
    signals = np.hstack([piece.inputs, piece.outputs])
    rest = max(_LEAST_REST, int(_REST * len(signals)))
    ends = (signals[:_LEAST_REST], signals[-rest:])
    level = ends[1].mean(0)
    swing = np.abs(signals - level).max(0)
    return all(bool((np.abs(end - level).max(0) < _STILL * swing).all()) for end in ends)


def _carrying(inputs: np.ndarray, harmonic: np.ndarray) -> np.ndarray:
    """Mask (K,) of harmonics with power of any input (R, K, n_u), compared with the strongest of their neighbours."""
    from scipy.ndimage import maximum_filter1d

    power = (np.abs(inputs[:, harmonic]) ** 2).mean(0)
    strongest = maximum_filter1d(power, 2 * _NEIGHBOURS + 1, axis=0)
    result = harmonic.copy()
    result[harmonic] = (power > _CARRIED * strongest).any(1)
    return result
