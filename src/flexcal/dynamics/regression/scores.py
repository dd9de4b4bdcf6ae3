"""Scores of an estimate, batch by batch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Scores:
    """Of one experiment, batch by batch (zero for one without rows), in coordinates in which the information of all is one.

    `score` (B, k) is the estimating function, `information` (B, k, k) the batch's share; `batches` have rows.
    """

    score: np.ndarray
    information: np.ndarray
    batches: int

    def of(self, onward: np.ndarray) -> Scores:
        """The scores times a matrix `onward` (k, k), and their information."""
        return Scores(self.score @ onward.T, onward @ self.information @ onward.T, self.batches)

    def after(self, step: np.ndarray) -> Scores:
        """Those after the parameters moved by `step` (k,)."""
        return Scores(self.score - self.information @ step, self.information, self.batches)
