"""Equations of one experiment as upper-triangular factors of consecutive batches."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.inverse_model import Equations
from flexcal.dynamics.regression.blocks import RegressionBlock, regression_blocks
from flexcal.dynamics.regression.triangular_factor import triangular
from flexcal.dynamics.signals import Experiment, Window
from flexcal.errors import FlexcalError
from flexcal.kernels import update

BATCHES = 128
"""Largest number of batches of an experiment, sufficient for the autocorrelation of its errors at any length."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Consecutive rows: `factors` has for every equation of the observation a matrix F with FᵀF = [W, Y]ᵀ[W, Y], by Householder
    reflections.

    `number` counts the batches of the experiment, whatever is left out; a batch without rows does not exist.
    """

    number: int
    rows: int
    factors: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class ExperimentSystem:
    """Equations of one experiment for the estimators; `masked` is the number of rows left out because the robot stood still.

    A batch without gaps has `batch_rows` rows. The rows lie within `duration` (s).
    """

    batches: tuple[Batch, ...]
    batch_rows: int
    duration: float
    masked: int


def experiment_system(
    observation: Equations,
    experiment: Experiment,
    decimation: Decimation,
    window: Window,
    *,
    mask_standstill: bool,
    batches: int = BATCHES,
    weights: np.ndarray | None = None,
) -> ExperimentSystem:
    """Equations of an experiment from one pass over it, in about `batches` batches of equal length at most.

    `weights` (equations, rows) are those of every equation's rows by their numbers; without, all count alike.
    Raises `FlexcalError` where no row is left, or a column comes out as not finite.
    """
    blocks = regression_blocks(observation, experiment, decimation, window)
    if weights is not None:
        blocks = (block.weighted(weights[:, block.number]) for block in blocks)
    length = batch_length(experiment, decimation, batches)
    return batched(blocks, experiment.name, length, mask_standstill=mask_standstill)


def batch_length(experiment: Experiment, decimation: Decimation, batches: int) -> int:
    """Rows of a batch without gaps, for at most about `batches` batches."""
    total = max(0, experiment.samples - 2 * decimation.support - 1) // decimation.factor + 1
    return -(-total // batches)


def batched(
    blocks: Iterable[RegressionBlock], name: str, length: int, *, mask_standstill: bool
) -> ExperimentSystem:
    """Rows of the experiment `name` in batches of `length`; raises `FlexcalError` as `experiment_system` does."""
    batches: list[Batch] = []
    masked = 0
    current: _Growing | None = None
    first, last = math.inf, -math.inf
    for block in blocks:
        if mask_standstill:
            masked += int(block.still.sum())
            block = block.where(~block.still)
        if len(block):
            first = min(first, float(block.time[0]))
            last = float(block.time[-1])
        for part in _split(block, length):
            number = int(part.number[0]) // length
            if current is None or current.number != number:
                batches += [] if current is None else [current.batch()]
                current = _Growing(number, part.projection)
            current.add(part)
    batches += [] if current is None else [current.batch()]
    if not all(np.isfinite(factor).all() for batch in batches for factor in batch.factors):
        raise FlexcalError("E-DYN-024", f"the equations of {name} are not finite.")
    if not batches:
        raise FlexcalError(
            "E-DYN-025",
            f"no equations remain of {name}: it, or the part that is fitted or held out, is too short for its filters, "
            "or the robot stands still in it.",
        )
    return ExperimentSystem(tuple(batches), length, last - first, masked)


class _Growing:
    """Batch updated by rows without storing them."""

    def __init__(self, number: int, projection: tuple[np.ndarray, ...]) -> None:
        self.number = number
        self._rows = 0
        self._projection = projection
        self._factors = [np.zeros((len(own) + 1, len(own) + 1)) for own in projection]

    def add(self, part: RegressionBlock) -> None:
        """Update with rows."""
        self._rows += len(part)
        for factor, system in zip(self._factors, part.reduced, strict=True):
            update(factor, system)

    def batch(self) -> Batch:
        whole = [
            np.column_stack([factor[:, :-1] @ projection, factor[:, -1]])
            for factor, projection in zip(self._factors, self._projection, strict=True)
        ]
        return Batch(self.number, self._rows, tuple(whole))


def reduced(systems: list[np.ndarray]) -> np.ndarray:
    """Factors R of stacked systems [W, Y] (·, k + 1), or the stack itself if it has no more rows."""
    stack = np.hstack([system.T for system in systems]).T
    return stack if len(stack) <= stack.shape[1] else triangular(stack)


def joined_systems(first: ExperimentSystem, second: ExperimentSystem) -> ExperimentSystem:
    """Equations of both experiments as one batch: factors R of their factors stacked, as one factorisation of all rows has them but for
    signs (TSQR).
    """
    batches = (*first.batches, *second.batches)
    rows = sum(batch.rows for batch in batches)
    factors = tuple(reduced(list(each)) for each in zip(*(batch.factors for batch in batches), strict=True))
    return ExperimentSystem(
        (Batch(0, rows, factors),), rows, max(first.duration, second.duration), first.masked + second.masked
    )


def _split(block: RegressionBlock, length: int) -> list[RegressionBlock]:
    """Splits by batch."""
    numbers = block.number // length
    if len(numbers) == 0 or numbers[0] == numbers[-1]:
        return [block] if len(numbers) else []
    return [block.where(numbers == number) for number in np.unique(numbers)]
