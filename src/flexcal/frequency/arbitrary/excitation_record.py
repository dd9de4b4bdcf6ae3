"""Records of an excited axis without an experiment plan: input, output and reference columns on a uniform time base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from flexcal.errors import FlexcalError

LONGEST = 65536
"""Largest number of samples of a piece: a longer record is divided, which lowers the resolution and leaves all data in use."""
SHORTEST = 64
_NEARLY_ALL = 0.9


@dataclass(frozen=True)
class Channel:
    """Column of a record: its name in the file, its unit, and the order of its time derivative.

    `derivative` is 0 for a position or a torque, 1 for a velocity, 2 for an acceleration.
    """

    name: str
    unit: str = ""
    derivative: int = 0


@dataclass(frozen=True, eq=False)
class ExcitationRecord:
    """One record of N samples every `time_step` s: inputs (N, n_u), outputs (N, n_y), references (N, n_r), n_r = 0 without any."""

    name: str
    time_step: float
    inputs: np.ndarray
    outputs: np.ndarray
    references: np.ndarray

    def __len__(self) -> int:
        return len(self.inputs)

    def part(self, first: int, end: int) -> ExcitationRecord:
        """Record of the samples from `first` to `end`."""
        return replace(
            self,
            inputs=self.inputs[first:end],
            outputs=self.outputs[first:end],
            references=self.references[first:end],
        )


def equal_pieces(records: Sequence[ExcitationRecord]) -> list[ExcitationRecord]:
    """Records cut into pieces of one length, at most `LONGEST` samples: the longest that uses nearly all samples.

    Raises `FlexcalError` where they are too short or have different time steps.
    """
    steps = [record.time_step for record in records]
    if max(steps) > (1 + 1e-3) * min(steps):
        raise FlexcalError(
            "E-FRF-001",
            f"{records[int(np.argmax(steps))].name} has a time step of {max(steps):g} s, {records[int(np.argmin(steps))].name} "
            f"one of {min(steps):g} s; give records of one rate together.",
        )
    lengths = [len(record) for record in records]
    limit = [length // (-(-length // LONGEST)) for length in lengths]
    used = {size: sum(n // size * size for n in lengths) for size in limit}
    size = max(size for size, total in used.items() if total >= _NEARLY_ALL * max(used.values()))
    if size < SHORTEST:
        raise FlexcalError(
            "E-FRF-002",
            f"{records[0].name} has {len(records[0])} samples without a gap; a frequency response needs {SHORTEST} or more.",
        )
    return [
        record.part(first, end)
        for record in records
        for first, end in pairwise(range(0, len(record) + 1, size))
    ]
