"""Zero-phase low-pass of finite length, for overlapping blocks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.errors import FlexcalError

_ORDER = 4
_SHORTEST_TRANSFORM = 8192


class TooFewSamples(FlexcalError):
    """Error: a signal is shorter than the impulse response of its filter."""


@dataclass(frozen=True)
class LowPass:
    """A fourth-order Butterworth filter forwards and backwards, at samples `time_step` (s) apart: -6 dB at `cutoff_hz`.

    Its response to frequency is |B|² of the bilinear transform, in closed form. The impulse response ends where its slowest mode has
    fallen to the share `tail`, `support` samples to either side. Raises `FlexcalError` where the cut-off is not below half the rate.
    """

    time_step: float
    cutoff_hz: float
    tail: float = 1e-12

    def __post_init__(self) -> None:
        if not 0 < self.cutoff_hz < 0.5 / self.time_step:
            raise FlexcalError(
                "E-LOG-020",
                f"a cut-off of {self.cutoff_hz:g} Hz is not between 0 and {0.5 / self.time_step:g} Hz, half the sampling rate; "
                "correct `cutoff_hz:` in robot.yaml, or the time, which is in seconds.",
            )

    @property
    def _corner(self) -> float:
        return math.tan(math.pi * self.cutoff_hz * self.time_step)

    @cached_property
    def support(self) -> int:
        """Number of samples on either side of a filtered one that it depends on."""
        angles = math.pi * (2 * np.arange(_ORDER) + _ORDER + 1) / (2 * _ORDER)
        poles = self._corner * np.exp(1j * angles)
        slowest = np.abs((1 + poles) / (1 - poles)).max()
        return math.ceil(math.log(self.tail) / math.log(slowest))

    @cached_property
    def _response(self) -> tuple[int, np.ndarray]:
        """Length of the transforms, and the transform of the finite impulse response, delayed by the support."""
        length = max(_SHORTEST_TRANSFORM, 1 << (8 * self.support).bit_length())
        gain = self.gain(np.arange(length // 2 + 1) / (length * self.time_step))
        impulse = np.roll(np.fft.irfft(gain, length), self.support)
        impulse[2 * self.support + 1 :] = 0.0
        return length, np.fft.rfft(impulse / impulse.sum())

    def fits(self, samples: int, beyond: int = 0) -> bool:
        """Whether the number of samples is sufficient for `before`."""
        return samples > self.support + beyond

    def gain(self, frequency_hz: np.ndarray) -> np.ndarray:
        """|B|² at frequencies (·,) up to half the sampling rate."""
        with np.errstate(over="ignore"):
            return 1.0 / (
                1.0 + (np.tan(math.pi * frequency_hz * self.time_step) / self._corner) ** (2 * _ORDER)
            )

    def before(self, values: np.ndarray, beyond: int = 0) -> np.ndarray:
        """The samples that precede `values` (N, n) when they go on as they begin, turned about the first by half a turn.

        There are `support` of them, and so many `beyond`. Raises `TooFewSamples` where N is not above their number.
        """
        count = self.support + beyond
        if not self.fits(len(values), beyond):
            raise TooFewSamples(
                "E-LOG-021",
                f"{len(values)} samples are too few for a cut-off of {self.cutoff_hz:g} Hz; {count + 1} are needed.",
            )
        return 2 * values[0] - values[count:0:-1]

    def apply(self, values: np.ndarray) -> np.ndarray:
        """`values` (N, n) filtered, (N - 2 · support, n): samples nearer to an end do not exist."""
        length, response = self._response
        lost = 2 * self.support
        rows = np.ascontiguousarray(values.T)
        result = np.empty((rows.shape[0], max(0, rows.shape[1] - lost)))
        step = length - lost
        for start in range(0, result.shape[1], step):
            part = np.fft.rfft(rows[:, start : start + length], length, axis=1)
            filtered = np.fft.irfft(part * response, length, axis=1)[:, lost:]
            stop = min(start + step, result.shape[1])
            result[:, start:stop] = filtered[:, : stop - start]
        return result.T
