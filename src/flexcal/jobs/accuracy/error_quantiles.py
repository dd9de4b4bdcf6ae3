"""Quantiles of very many positive numbers from counts in logarithmic classes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RELATIVE_ERROR = 1e-3
"""Largest relative error of a quantile: half the width of a class."""
_WIDTH = float(np.log1p(RELATIVE_ERROR) - np.log1p(-RELATIVE_ERROR))
_LOWEST = 1e-12
"""Upper end of the lowest class, m, which takes all that is smaller."""


@dataclass(frozen=True, eq=False)
class ErrorQuantiles:
    """Counts (K,) of values in classes k of equal width in their logarithm, the lowest class number `first`, and the `largest` value.

    Quantiles have a relative error of at most 0.1 % (the sketch of Masson, Rim & Lee, "DDSketch", 2019). Counts of parts add up, in any
    order, to those of all.
    """

    first: int
    counts: np.ndarray
    largest: float

    @classmethod
    def of(cls, values: np.ndarray) -> ErrorQuantiles:
        """Counts of `values` (N,), m."""
        number = np.ceil(np.log(np.maximum(values, _LOWEST) / _LOWEST) / _WIDTH).astype(np.int64)
        first = int(number.min())
        return cls(first, np.bincount(number - first), float(values.max()))

    def __add__(self, other: ErrorQuantiles) -> ErrorQuantiles:
        first = min(self.first, other.first)
        counts = np.zeros(max(one.first + len(one.counts) for one in (self, other)) - first, dtype=np.int64)
        for one in (self, other):
            counts[one.first - first :][: len(one.counts)] += one.counts
        return ErrorQuantiles(first, counts, max(self.largest, other.largest))

    def quantile(self, share: float) -> float:
        """Value that the `share` (0 to 1) of all values does not exceed, m; the largest one is exact."""
        if share >= 1:
            return self.largest
        below = np.cumsum(self.counts)
        number = self.first + int(np.searchsorted(below, share * (below[-1] - 1), side="right"))
        return min(self.largest, _LOWEST * float(np.exp((number - 0.5) * _WIDTH)))
