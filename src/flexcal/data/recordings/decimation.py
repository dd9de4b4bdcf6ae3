"""Decimation of many columns at once, without phase shift: whole, or block by block."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from flexcal.errors import FlexcalError

_REACH = 10
"""Half length of a decimation filter, in output samples."""
_LARGEST_STAGE = 10
_TOGETHER = 10
"""Number of output samples per matrix product: more of them multiply more zeros, fewer make thinner matrices."""


@dataclass(frozen=True)
class Decimation:
    """Every `factor`-th sample after a symmetric filter of finite length: blocks that overlap by `support` give what the whole gives.

    Stages of at most 10, each a Hamming-windowed filter of 20 · stage + 1 samples. Raises `FlexcalError` for a factor below 1 or with a
    prime factor above 10.
    """

    factor: int

    def __post_init__(self) -> None:
        if self.factor < 1:
            raise FlexcalError("E-LOG-001", f"the decimation is {self.factor}; it must be 1 or more.")
        _ = self.stages

    @classmethod
    def near(cls, factor: float) -> Decimation:
        """Decimation by the largest possible factor up to `factor`, or by 1."""
        whole = max(1, int(factor))
        while True:
            try:
                return cls(whole)
            except FlexcalError:
                whole -= 1

    @cached_property
    def stages(self) -> tuple[int, ...]:
        """Factors of at most 10 whose product is `factor`, the larger first."""
        stages, left = [], self.factor
        while left > 1:
            stage = next((k for k in range(_LARGEST_STAGE, 1, -1) if left % k == 0), None)
            if stage is None:
                raise FlexcalError(
                    "E-LOG-002",
                    f"the decimation {self.factor} has a prime factor above {_LARGEST_STAGE}; take a number that divides by less.",
                )
            stages.append(stage)
            left //= stage
        return tuple(stages)

    @property
    def support(self) -> int:
        """Number of input samples on either side of an output sample that it depends on; there are no output samples nearer to an end."""
        reach, spacing = 0, 1
        for stage in self.stages:
            reach += _REACH * stage * spacing
            spacing *= stage
        return reach

    def apply(self, columns: np.ndarray) -> np.ndarray:
        """Filtered `columns` (k, N) at samples support, support + factor, …: (k, M), empty unless N is above 2 · support."""
        return DecimationStream(self).push(columns)


class DecimationStream:
    """Block-wise decimation with the result of the whole; samples still needed by the filters are kept."""

    def __init__(self, decimation: Decimation) -> None:
        self._stages = decimation.stages
        self._pending: list[np.ndarray | None] = [None] * len(self._stages)

    def push(self, columns: np.ndarray) -> np.ndarray:
        """Output samples (k, M) completed by the next `columns` (k, N); M may be zero."""
        for i, stage in enumerate(self._stages):
            pending = self._pending[i]
            columns, self._pending[i] = _decimated(
                columns[:, :0] if pending is None else pending, columns, stage
            )
        return columns


def _decimated(pending: np.ndarray, columns: np.ndarray, stage: int) -> tuple[np.ndarray, np.ndarray]:
    """Every `stage`-th sample of the filtered `columns` after `pending` ones, as products with a matrix whose columns are the shifted
    filter, and the samples that are pending then.
    """
    before, length = pending.shape[1], 2 * _REACH * stage + 1
    count = max(0, (before + columns.shape[1] - length) // stage + 1)
    shifted = _shifted_filter(stage)
    kept = np.empty((len(columns), count))
    for start in range(0, count, _TOGETHER):
        number = min(_TOGETHER, count - start)
        first, reach = start * stage, (number - 1) * stage + length
        if first >= before:
            part = columns[:, first - before : first - before + reach]
        else:
            part = np.concatenate([pending[:, first:], columns[:, : max(0, first + reach - before)]], axis=1)[
                :, :reach
            ]
        np.matmul(part, shifted[:reach, :number], out=kept[:, start : start + number])
    spent = stage * count
    left = columns[:, max(0, spent - before) :]
    return kept, left.copy() if spent >= before else np.concatenate([pending[:, spent:], left], axis=1)


@cache
def _shifted_filter(stage: int) -> np.ndarray:
    length = 2 * _REACH * stage + 1
    taps = np.sinc(np.arange(-_REACH * stage, _REACH * stage + 1) / stage) * np.hamming(length)
    matrix = np.zeros(((_TOGETHER - 1) * stage + length, _TOGETHER))
    for k in range(_TOGETHER):
        matrix[k * stage : k * stage + length, k] = taps / taps.sum()
    return matrix
