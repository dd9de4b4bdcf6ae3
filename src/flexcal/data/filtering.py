"""Filters without phase shift: low-pass, central differences, decimation of many columns at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError

_ORDER = 4
_REACH = 10
"""Half the length of a decimation filter, in samples that it leaves."""
_LARGEST_STAGE = 10


def low_pass(values: np.ndarray, time_step: float, cutoff_hz: float) -> np.ndarray:
    """`values` (N, …) through a fourth-order Butterworth filter forwards and backwards: no phase, -6 dB at `cutoff_hz`.

    Raises `FlexcalError` where the cut-off is not below half the sampling rate, or there are too few samples.
    """
    from scipy.signal import butter, sosfiltfilt

    rate = 1.0 / time_step
    if not 0 < cutoff_hz < rate / 2:
        raise FlexcalError(
            f"a cut-off of {cutoff_hz:g} Hz is not between 0 and {rate / 2:g} Hz, half the sampling rate."
        )
    padding = int(np.ceil(3 * rate / cutoff_hz))
    if len(values) <= padding:
        raise FlexcalError(
            f"{len(values)} samples are too few for a cut-off of {cutoff_hz:g} Hz; {padding + 1} are needed."
        )
    sections = butter(_ORDER, cutoff_hz, fs=rate, output="sos")
    return sosfiltfilt(sections, values, axis=0, padlen=padding)


def central_difference(values: np.ndarray, time_step: float) -> np.ndarray:
    """Derivative (N, …) of `values` by central differences; one-sided at the first and last sample."""
    return np.gradient(values, time_step, axis=0)


@dataclass(frozen=True)
class Decimation:
    """Every `factor`-th sample after a symmetric filter of finite length: blocks that overlap by `support` give what the whole gives.

    Stages of at most 10, each a Hamming-windowed filter of 20 · stage + 1 samples. Raises `FlexcalError` for a factor below 1 or with a
    prime factor above 10.
    """

    factor: int

    def __post_init__(self) -> None:
        if self.factor < 1:
            raise FlexcalError(f"the decimation is {self.factor}; it must be 1 or more.")
        _ = self.stages

    @property
    def stages(self) -> tuple[int, ...]:
        """Factors of at most 10 whose product is `factor`, the larger first."""
        stages, left = [], self.factor
        while left > 1:
            stage = next((k for k in range(_LARGEST_STAGE, 1, -1) if left % k == 0), None)
            if stage is None:
                raise FlexcalError(
                    f"the decimation {self.factor} has a prime factor above {_LARGEST_STAGE}; take a number that divides by less."
                )
            stages.append(stage)
            left //= stage
        return tuple(stages)

    @property
    def support(self) -> int:
        """Samples before and after a kept one that it depends on; kept samples nearer to an end do not exist."""
        reach, spacing = 0, 1
        for stage in self.stages:
            reach += _REACH * stage * spacing
            spacing *= stage
        return reach

    def apply(self, columns: np.ndarray) -> np.ndarray:
        """`columns` (…, N) at samples support, support + factor, …: (…, M), empty where N is not above 2 · support."""
        from scipy.signal import firwin, upfirdn

        for stage in self.stages:
            length = 2 * _REACH * stage
            if columns.shape[-1] <= length:
                return columns[..., :0]
            taps = firwin(length + 1, 1.0 / stage, window="hamming")
            last = (columns.shape[-1] - 1) // stage
            columns = upfirdn(taps, columns, down=stage, axis=-1)[..., 2 * _REACH : last + 1]
        return columns
