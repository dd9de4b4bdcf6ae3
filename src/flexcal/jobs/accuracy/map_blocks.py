"""Accuracy map of very many random poses, block by block: what its page needs, in memory that does not grow with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.accuracy import (
    PredictedAccuracy,
    Registration,
    predicted_accuracy,
    random_poses_in,
)
from flexcal.calibration.measurement import Propagation
from flexcal.jobs.accuracy.error_quantiles import ErrorQuantiles
from flexcal.jobs.accuracy.map_table import MapTable, places_apart
from flexcal.parallel import Workers
from flexcal.progress import Progress

BLOCK = 20_000
"""Number of poses of a block, and the largest number that is held at once."""


@dataclass(frozen=True, eq=False)
class MapSummary:
    """What is kept of `poses` poses: quantiles of the errors, and the worst ones, `apart` (m) from each other.

    `uncalibrated` is None where it is not known.
    """

    poses: int
    mean: ErrorQuantiles
    p95: ErrorQuantiles
    uncalibrated: ErrorQuantiles | None
    worst: PredictedAccuracy
    apart: float

    @classmethod
    def of(cls, predicted: PredictedAccuracy, uncalibrated: np.ndarray | None, apart: float) -> MapSummary:
        """Summary of poses with their errors."""
        return cls(
            len(predicted.q),
            ErrorQuantiles.of(predicted.mean),
            ErrorQuantiles.of(predicted.p95),
            None if uncalibrated is None else ErrorQuantiles.of(uncalibrated),
            predicted.part(places_apart(predicted, apart)),
            apart,
        )

    def __add__(self, other: MapSummary) -> MapSummary:
        """Both together; the worst places of both are thinned to those apart from each other."""
        worst = PredictedAccuracy.joined([self.worst, other.worst])
        return MapSummary(
            self.poses + other.poses,
            self.mean + other.mean,
            self.p95 + other.p95,
            None
            if self.uncalibrated is None or other.uncalibrated is None
            else self.uncalibrated + other.uncalibrated,
            worst.part(places_apart(worst, self.apart)),
            self.apart,
        )


@dataclass(frozen=True, eq=False)
class MapBlocks:
    """Random poses of a map in blocks after the first: `count` in all, in the `box` or anywhere.

    `registration` is the place of the uncalibrated robot that fits the poses of the first block; None where that is not known. Errors are
    multiplied by `factor`. Worst places are `apart`, m. A `block` is so many poses.
    """

    reach: Propagation
    box: np.ndarray | None
    count: int
    seed: int
    factor: float
    registration: Registration | None
    apart: float
    block: int = BLOCK

    def summarised(
        self,
        first: MapSummary,
        workers: Workers,
        append: Callable[[Mapping[str, np.ndarray]], None] | None,
        progress: Progress,
    ) -> MapSummary:
        """Summary of all poses, `first` being that of the first block; `append` is given the rows of the others, in their order."""
        numbers = range(1, -(-self.count // self.block))
        total = first
        for summary, table in workers.values(_block, numbers, self, append is not None, workers.count > 1):
            total = total + summary
            if append is not None and table is not None:
                append(table.columns)
            progress("accuracy map", total.poses / self.count)
        return total


def _block(
    number: int, blocks: MapBlocks, rows: bool, beside_others: bool
) -> tuple[MapSummary, MapTable | None]:
    """Summary of a block, and its `rows` if they are wanted; in one thread if other tasks run beside it."""
    rng = np.random.default_rng([blocks.seed, 7, number])
    q = random_poses_in(
        blocks.reach, min(blocks.block, blocks.count - number * blocks.block), rng, blocks.box
    )
    predicted = predicted_accuracy(blocks.reach, q, threads=1 if beside_others else None).scaled(
        blocks.factor
    )
    apart = None if blocks.registration is None else blocks.registration.distance(q)
    return MapSummary.of(predicted, apart, blocks.apart), MapTable(predicted, apart) if rows else None
