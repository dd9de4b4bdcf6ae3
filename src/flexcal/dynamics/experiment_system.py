"""The equations of one experiment in the space of few: R factors of batches that follow each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexcal.data.filtering import Decimation
from flexcal.dynamics.observation import Observation
from flexcal.dynamics.rows import Experiment, Rows, Window, rows
from flexcal.dynamics.triangle import triangular
from flexcal.errors import FlexcalError

BATCHES = 128
"""Batches of an experiment, at most: enough to see how its errors hang together in time, however long it is."""
_TOGETHER = 1024
"""Rows that are brought into triangular form at once."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Rows that follow each other: `factors` has for every equation of the observation R of [W, Y], or the rows where they are fewer.

    `number` counts the batches of the experiment, whatever is left out; a batch without rows does not exist.
    """

    number: int
    rows: int
    factors: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class ExperimentSystem:
    """All that estimators need of one experiment; `masked` are the rows left out because the robot stood still.

    A batch without gaps has `batch_rows` rows. The rows lie within `duration` (s).
    """

    batches: tuple[Batch, ...]
    batch_rows: int
    duration: float
    masked: int


def experiment_system(
    observation: Observation,
    experiment: Experiment,
    decimation: Decimation,
    window: Window,
    *,
    mask_standstill: bool,
    batches: int = BATCHES,
    weights: np.ndarray | None = None,
) -> ExperimentSystem:
    """One pass over an experiment, in at most about so many `batches` of equal length.

    `weights` (equations, rows) are those of every equation's rows by their numbers; without, all count alike.
    Raises `FlexcalError` where no row is left, or a column comes out as not finite.
    """
    total = max(0, experiment.samples - 2 * decimation.support - 1) // decimation.factor + 1
    length = -(-total // batches)
    found: list[Batch] = []
    masked = 0
    current: _Growing | None = None
    first, last = math.inf, -math.inf
    for block in rows(observation, experiment, decimation, window):
        if mask_standstill:
            masked += int(block.still.sum())
            block = block.where(~block.still)
        if weights is not None:
            block = block.weighted(weights[:, block.number])
        if len(block):
            first = min(first, float(block.time[0]))
            last = float(block.time[-1])
        if not all(np.isfinite(system).all() for system in block.systems):
            raise FlexcalError(f"the equations of {experiment.name} are not finite.")
        for part in _split(block, length):
            number = int(part.number[0]) // length
            if current is None or current.number != number:
                found += [] if current is None else [current.batch()]
                current = _Growing(number, len(part.systems))
            current.add(part)
    found += [] if current is None else [current.batch()]
    if not found:
        raise FlexcalError(
            f"no equation is left of {experiment.name}: it is too short for its filters, or the robot stands still in it."
        )
    return ExperimentSystem(tuple(found), length, last - first, masked)


class _Growing:
    """A batch to which rows come; it holds few of them."""

    def __init__(self, number: int, equations: int) -> None:
        self.number = number
        self._rows = 0
        self._held: list[list[np.ndarray]] = [[] for _ in range(equations)]
        self._waiting = 0

    def add(self, part: Rows) -> None:
        for held, system in zip(self._held, part.systems, strict=True):
            held.append(system.T)
        self._rows += len(part)
        self._waiting += len(part)
        if self._waiting >= _TOGETHER:
            self._reduce()

    def batch(self) -> Batch:
        self._reduce()
        return Batch(self.number, self._rows, tuple(held[0] for held in self._held))

    def _reduce(self) -> None:
        self._held = [[reduced(held)] for held in self._held]
        self._waiting = 0


def reduced(systems: list[np.ndarray]) -> np.ndarray:
    """R of systems [W, Y] (·, k + 1) stacked, or just the stack where that has no more rows than R would."""
    stack = np.hstack([system.T for system in systems]).T
    return stack if len(stack) <= stack.shape[1] else triangular(stack)


def _split(block: Rows, length: int) -> list[Rows]:
    """By batch."""
    numbers = block.number // length
    if len(numbers) == 0 or numbers[0] == numbers[-1]:
        return [block] if len(numbers) else []
    return [block.where(numbers == number) for number in np.unique(numbers)]
