"""Interior-point minimisation: logarithmic barrier with L-BFGS steps (Nocedal & Wright 2006)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

_MEMORY = 15
_DECREASE = 1e-4
"""Share of the decrease predicted by the slope that a step must achieve."""
_SHORTEST = 1e-6
_FLAT = 1e-4
"""Decrease of f over `_PATIENCE` steps below which a round ends."""
_PATIENCE = 8


@dataclass(frozen=True, eq=False)
class BarrierValue:
    """Value of the barrier function, inf outside the limits, the `gradient` (k,) and `curved`: the approximate inverse Hessian of the
    barrier times a vector.
    """

    value: float
    gradient: Callable[[], np.ndarray]
    curved: Callable[[np.ndarray], np.ndarray]


class BarrierProblem(Protocol):
    """Function to be minimised within limits."""

    def evaluate(self, x: np.ndarray, barrier: float) -> BarrierValue:
        """Barrier function f(x) - `barrier` Σ log(slack of the limits)."""
        ...


def minimise(program: BarrierProblem, x: np.ndarray, barriers: list[float], steps: int) -> np.ndarray:
    """Minimise from a feasible `x`; at most `steps` steps with each of the falling `barriers`."""
    for barrier in barriers:
        x = _descend(program, x, barrier, steps)
    return x


def _descend(program: BarrierProblem, x: np.ndarray, barrier: float, steps: int) -> np.ndarray:
    at = program.evaluate(x, barrier)
    gradient = at.gradient()
    pairs: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=_MEMORY)
    values = [at.value]
    for _ in range(steps):
        direction = -_two_loops(gradient, pairs, at.curved)
        slope = float(direction @ gradient)
        if not slope < 0:
            pairs.clear()
            direction = -at.curved(gradient)
            slope = float(direction @ gradient)
        length = 1.0
        while True:
            ahead = program.evaluate(x + length * direction, barrier)
            if ahead.value <= at.value + _DECREASE * length * slope:
                break
            length /= 2
            if length < _SHORTEST:
                return x
        later = ahead.gradient()
        step, change = length * direction, later - gradient
        if step @ change > 1e-10 * np.linalg.norm(step) * np.linalg.norm(change):
            pairs.append((step, change))
        x, at, gradient = x + step, ahead, later
        values.append(at.value)
        if len(values) > _PATIENCE and values[-1 - _PATIENCE] - values[-1] < _FLAT:
            break
    return x


def _two_loops(
    gradient: np.ndarray,
    pairs: deque[tuple[np.ndarray, np.ndarray]],
    curved: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """L-BFGS's inverse Hessian times the gradient, begun with `curved`."""
    left = gradient.copy()
    shares = []
    for step, change in reversed(pairs):
        shares.append((step @ left) / (step @ change))
        left -= shares[-1] * change
    product = curved(left)
    for (step, change), share in zip(pairs, reversed(shares), strict=True):
        product += (share - (change @ product) / (step @ change)) * step
    return product
