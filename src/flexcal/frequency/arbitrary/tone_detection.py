"""Detection of an excitation that consists of few frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.frequency.arbitrary.excitation_record import ExcitationRecord

_ALL, _NEARLY_ALL = 0.999, 0.95
"""Shares of the power in the lines from which the rest counts as absent, and as small."""
_MOST = 6
_LOBE = 3
"""Bins on either side of a line covered by the main lobe of a Hann window and interpolation between bins."""
_FIRST = 2


@dataclass(frozen=True)
class Tones:
    """Frequencies (Hz), ascending, of the few lines that hold the inputs' power; `alone` tells whether there is nothing else."""

    frequencies_hz: tuple[float, ...]
    alone: bool

    @property
    def sentence(self) -> str:
        """Description of the input, and of the excitation required instead."""
        nearly = "" if self.alone else "nearly "
        listed = ", ".join(f"{frequency:.4g}" for frequency in self.frequencies_hz)
        said = f"{len(self.frequencies_hz)} sines, of {listed} Hz"
        if len(self.frequencies_hz) == 1:
            said = f"a sine of one frequency, {listed} Hz"
        return (
            f"the input is {nearly}{said}, and a frequency response needs a band; excite with a swept sine, noise or a multisine from "
            "below the lowest resonance to above the highest."
        )


def detect_tones(pieces: Sequence[ExcitationRecord]) -> Tones | None:
    """Tones of records of equal length; None unless six lines hold 95 % of the power."""
    size = len(pieces[0])
    window = np.hanning(size)[:, None]
    power = np.zeros(size // 2 + 1)
    for piece in pieces:
        moved = piece.inputs - piece.inputs.mean(0)
        power += (np.abs(np.fft.rfft(window * moved, axis=0)) ** 2).sum(1)
    power[:_FIRST] = 0.0
    whole, frequencies = power.sum(), []
    if not whole > 0:
        return None
    left, few = power.copy(), 0
    while len(frequencies) < _MOST and left.sum() > (1.0 - _ALL) * whole:
        at = int(left.argmax())
        lobe = slice(max(at - _LOBE, 0), at + _LOBE + 1)
        centre = np.average(np.arange(size // 2 + 1)[lobe], weights=left[lobe])
        frequencies.append(float(centre / (size * pieces[0].time_step)))
        left[lobe] = 0.0
        if not few and left.sum() <= (1.0 - _NEARLY_ALL) * whole:
            few = len(frequencies)
    alone = bool(left.sum() <= (1.0 - _ALL) * whole)
    return Tones(tuple(sorted(frequencies if alone else frequencies[:few])), alone) if few else None
