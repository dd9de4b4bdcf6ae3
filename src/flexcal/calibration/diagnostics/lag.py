"""Lag of one reading behind another: first-order estimate by a score test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.estimation import f_tail

_CHANCE = 1e-6
"""Significance level of a lag: what else goes with the order of measuring must not be called one."""


@dataclass(frozen=True)
class Lag:
    """`lag` ± `std` (1σ), s, or `rows` where these are not `timed`; negative: ahead.

    `share` of the weighted squares of the residuals, 0 to 1, is explained by it, and `rival` by what else goes with the order of measuring;
    `probability` is the p-value of the F test for none. `least_share` is the share from which there is one.
    """

    least_share: ClassVar[float]
    rows: ClassVar[str]

    lag: float
    std: float
    share: float
    rival: float
    probability: float
    timed: bool

    @property
    def certain(self) -> bool:
        """Whether there is one: significant, a good part of the residuals, and more of them than its rival explains."""
        return self.probability < _CHANCE and self.share > max(self.least_share, self.rival)

    def document(self) -> dict[str, Any]:
        """Block of a JSON document."""
        return {
            "lag": self.lag,
            "std": self.std,
            "unit": "s" if self.timed else self.rows,
            "share": self.share,
            "p": self.probability,
            "certain": self.certain,
        }

    @classmethod
    def by_products(
        cls, products: np.ndarray, rival: slice, freedom: int, timed: bool, least: float
    ) -> Self | None:
        """By scalar products of columns, the effect of a unit lag first, those of its `rival`, and, last, the residuals with `freedom`
        degrees of freedom beside the lag, whose variance is `least` or larger; None where they tell nothing.
        """
        total, own, along = products[-1, -1], products[0, 0], products[0, -1]
        if freedom < 1 or own <= 0 or total <= 0:
            return None
        explained = along**2 / own
        variance = max((total - explained) / freedom, least, 1e-12 * total)
        by_rival = np.linalg.lstsq(products[rival, rival], products[rival, -1], rcond=1e-9)[0]
        return cls(
            float(along / own),
            float(np.sqrt(variance / own)),
            float(explained / total),
            float(by_rival @ products[rival, -1] / total),
            f_tail(1, freedom, float(explained / variance)),
            timed,
        )


def measuring_times(poses: PoseSet) -> tuple[np.ndarray, bool]:
    """Times (N,) of the file, s, where they ascend, else numbers of the rows; and which of them."""
    if poses.time is not None and bool((np.diff(poses.time) > 0).all()):
        return poses.time, True
    return np.arange(len(poses), dtype=float), False
