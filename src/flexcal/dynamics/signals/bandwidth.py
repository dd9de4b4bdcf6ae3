"""Bandwidth of a recorded motion, from the spectrum of its positions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import Recording

_SEGMENT = 8.0
"""Length, s, of the segments of the spectrum."""
_SHARE = 0.99
_NOISE_ABOVE = 0.7
"""Share of half the sampling rate above which the positions are assumed to be noise."""


@dataclass(frozen=True)
class MotionBandwidth:
    """Bandwidth `frequency_hz`, below which lies 99 % of the power of all joints' velocities (0 at rest); `rate_hz` is the sampling
    rate.
    """

    frequency_hz: float
    rate_hz: float


def motion_bandwidth(recordings: Iterable[Recording]) -> MotionBandwidth:
    """Bandwidth of consecutive recordings, as blocks of one log, in constant memory.

    Position spectra of segments of 8 s (of all, where there is less) with a Hann window, averaged, less the level that they have at the
    highest frequencies, times ω².
    """
    power, step = np.zeros((1, 1)), 1.0
    for number, (own_step, segment) in enumerate(_segments(recordings)):
        line = np.linspace(0.0, 1.0, len(segment))[:, None]
        level = segment - segment[0] - line * (segment[-1] - segment[0])
        spectrum = np.abs(np.fft.rfft(level * np.hanning(len(segment))[:, None], axis=0)) ** 2
        power, step = (spectrum if number == 0 else power + spectrum), own_step
    samples = 2 * (len(power) - 1)
    frequency = np.arange(len(power)) / (samples * step)
    noise = np.mean(power[frequency > _NOISE_ABOVE * 0.5 / step], axis=0)
    moved = np.sum(np.maximum(power - 3.0 * noise, 0.0), axis=1) * frequency**2
    reached = np.cumsum(moved)
    if reached[-1] == 0:
        return MotionBandwidth(0.0, 1.0 / step)
    return MotionBandwidth(float(frequency[np.searchsorted(reached, _SHARE * reached[-1])]), 1.0 / step)


def _segments(recordings: Iterable[Recording]) -> Iterator[tuple[float, np.ndarray]]:
    """Position segments of equal even length without gaps, with their time step; a remainder may be left out."""
    pending, longest = np.zeros((0, 0)), np.zeros((0, 0))
    step, whole = 0.0, False
    for recording in recordings:
        step, base = recording.time_step, recording.time_base
        begins = not pending.size or (base is not None and base.gap > 0)
        pending = recording.q if begins else np.concatenate([pending, recording.q])
        longest = max(longest, pending, key=len)
        length = 2 * round(_SEGMENT / step / 2)
        while len(pending) >= length:
            whole = True
            yield step, pending[:length]
            pending = pending[length:]
    if not whole:
        yield step, longest[: len(longest) // 2 * 2]
