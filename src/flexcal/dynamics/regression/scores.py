"""Scores of an estimate, batch by batch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of one experiment, batch by batch (zero for one without rows), in coordinates of unit total information.

    `score` (B, k) is the estimating function, `information` (B, k, k) the batch's share; `batches` have rows.
    """

    score: np.ndarray
    information: np.ndarray
    batches: int

    def of(self, onward: np.ndarray) -> Scores:
        """Scores times a matrix `onward` (k, k), and their information."""
        return Scores(self.score @ onward.T, onward @ self.information @ onward.T, self.batches)

    def after(self, step: np.ndarray) -> Scores:
        """Scores after a step `step` (k,) of the parameters."""
        return Scores(self.score - self.information @ step, self.information, self.batches)
