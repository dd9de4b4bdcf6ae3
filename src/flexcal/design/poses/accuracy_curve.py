"""Predicted tool error against the number of poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.design.optimality import TraceOptimal, greedy
from flexcal.design.poses.selection import PoseDesign, tool_error
from flexcal.errors import FlexcalError
from flexcal.progress import Progress, silent


@dataclass(frozen=True, eq=False)
class PoseCurve:
    """Predicted root mean square tool error (K,), m, after measuring `counts` (K,) poses: `chosen` one by one, and at `random`.

    `random` is the median over sets drawn from the same candidates. Both are from tracker noise alone.
    """

    counts: np.ndarray
    chosen: np.ndarray
    random: np.ndarray

    def enough(self, excess: float = 0.1) -> int:
        """First count after which the chosen error falls by less than `excess` (relative) when the number of poses is doubled.

        Noise alone falls by √½ with every doubling, so what is compared is the excess over that law. The last count if none does.
        """
        scaled = self.chosen * np.sqrt(self.counts)
        level = scaled[-1]
        good = np.flatnonzero(scaled <= (1 + excess) * level)
        return int(self.counts[good[0]])


def pose_curve(
    design: PoseDesign,
    *,
    rng: np.random.Generator,
    counts: Sequence[int] = (),
    random_sets: int = 15,
    progress: Progress = silent,
) -> PoseCurve:
    """Accuracy curve for `counts`, by default from the fewest that determine the parameters to four times the chosen number.

    The chosen sets are nested (each adds the best candidate), so they lie slightly above what an exchange for that count reaches.
    """
    sensitivity = design.base.sensitivity
    total = design.sample
    if not len(counts):
        most = min(total, 4 * len(design.plan))
        counts = np.unique(
            np.geomspace(min(design.fewest, len(design.plan)), most, 16).round().astype(int)
        ).tolist()
    if min(counts) < 1 or max(counts) > total:
        raise FlexcalError("E-DESIGN-020", f"counts must lie between 1 and the {total} candidates.")
    progress("how many", 0.0)
    order = greedy(sensitivity, max(counts), TraceOptimal(design.tool_error_weight, "c")).chosen
    chosen = [tool_error(design.base, design.tool_error_weight, order[:k]) for k in counts]
    random = []
    for k in counts:
        sets = (rng.choice(total, k, replace=False) for _ in range(random_sets))
        random.append(np.median([tool_error(design.base, design.tool_error_weight, drawn) for drawn in sets]))
        progress("how many", len(random) / len(counts))
    return PoseCurve(np.array(counts), np.array(chosen), np.array(random))
