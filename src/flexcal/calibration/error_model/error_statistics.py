"""Statistics of position errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class ErrorStatistics:
    """Mean, 90th percentile and maximum of the distances (m) over a number of poses; nan without poses."""

    poses: int
    mean: float
    p90: float
    max: float

    @classmethod
    def of(cls, errors: np.ndarray) -> ErrorStatistics:
        """Statistics of error vectors (N, 3), m."""
        distance = np.linalg.norm(errors, axis=1)
        if not len(distance):
            return cls(0, np.nan, np.nan, np.nan)
        return cls(
            len(distance), float(distance.mean()), float(np.quantile(distance, 0.9)), float(distance.max())
        )

    @classmethod
    def of_millimetres(cls, block: Mapping[str, Any]) -> ErrorStatistics:
        """Statistics read from a block of results.json, as `in_millimetres` makes it."""
        values = (block[key] for key in ("mean_mm", "p90_mm", "max_mm"))
        return cls(block["poses"], *(np.nan if v is None else v * MILLIMETRE for v in values))

    def in_millimetres(self) -> dict[str, float | int | None]:
        """Block of results.json: poses, mean_mm, p90_mm, max_mm; null without poses."""
        values = {"mean_mm": self.mean, "p90_mm": self.p90, "max_mm": self.max}
        return {"poses": self.poses} | {
            key: v / MILLIMETRE if self.poses else None for key, v in values.items()
        }

    def __str__(self) -> str:
        if not self.poses:
            return "no measured points"
        mean, p90, largest = (v / MILLIMETRE for v in (self.mean, self.p90, self.max))
        return f"mean {mean:.3f}, p90 {p90:.3f}, max {largest:.3f} mm over {self.poses} poses"
