"""Anderson's acceleration of a fixed-point iteration."""

from __future__ import annotations

from collections import deque

import numpy as np

_MEMORY = 4
"""Earlier points that take part; each removes one slow direction of the iteration."""


class AndersonAcceleration:
    """Extrapolation of steps that contract linearly, from the last few of them (Anderson 1965; Walker & Ni 2011, type II).

    Gauss-Newton steps contract by the curvature of the residuals, which the linearisation lacks, and reweighted ones by that of the loss.
    The last points and their steps are combined with weights that sum to one, such that the combined step is the shortest.
    """

    def __init__(self) -> None:
        self._points = deque[np.ndarray](maxlen=_MEMORY + 1)
        self._steps = deque[np.ndarray](maxlen=_MEMORY + 1)

    def forget(self) -> None:
        """Begin anew, as where the iteration is another one from here on."""
        self._points.clear()
        self._steps.clear()

    @property
    def extrapolates(self) -> bool:
        """Whether the last step was of several points."""
        return len(self._points) > 1

    def step(self, x: np.ndarray, plain: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """Step (p,) in place of the `plain` one (p,) at `x` (p,); lengths are those of `factor` (k, p) times a step."""
        self._points.append(x)
        self._steps.append(plain)
        if len(self._steps) == 1:
            return plain
        steps = np.diff(np.array(self._steps), axis=0).T
        points = np.diff(np.array(self._points), axis=0).T
        share = np.linalg.lstsq(factor @ steps, factor @ plain, rcond=1e-8)[0]
        return plain - (points + steps) @ share
