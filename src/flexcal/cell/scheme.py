"""The plant's time stepping as a linear recurrence: what is exact, what is not, and whether it is stable.

MuJoCo's semi-implicit Euler step is a kick and a drift, w₊ = w + h M⁻¹ f, q₊ = q + h w₊, that is M (q₊ − 2 q + q₋)/h² = f. The exact
solution of M q̈ = f(t) satisfies it with f averaged over (−h, h) with triangular weights. So the loop applies

- the held torque at its jumps as the mean of both sides: exact;
- a spring's force at q + h² q̈/12 (Numerov), q̈ extrapolated: wrong by O(h⁴);
- a damper's force at the rate (23 w − 16 w₋ + 5 w₋₋)/12 (Adams): wrong by O(h³);
- gravity and Coriolis forces at q and w, as MuJoCo does: O(h²), and small.

Dampers at w alone act as inertia h d/2: at 0.25 ms that biases the TX90L's stiffnesses by up to 6 %; as above, by less than 0.05 %.
"""

from __future__ import annotations

import numpy as np


def recurrence(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, springs: np.ndarray, step: float
) -> np.ndarray:
    """Matrix (4 d, 4 d) of one free step of (q, w, w₋, w₋₋); `springs` (d,) is the springs' share of the stiffness's diagonal."""
    d = len(mass)
    one, zero = np.eye(d), np.zeros((d, d))
    pull, drag, bend = np.linalg.solve(
        mass, np.stack([stiffness * step, damping * step / 12, np.diag(springs) * step**2 / 12])
    )
    rate = [-pull, one - 23 * drag - 2 * bend, 16 * drag + 3 * bend, -5 * drag - bend]
    drift = [one + step * rate[0], *(step * part for part in rate[1:])]
    return np.block([drift, rate, [zero, one, zero, zero], [zero, zero, one, zero]])


def growth(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, springs: np.ndarray, step: float
) -> float:
    """Fastest growth rate, 1/s, of the free recurrence; an arm that would fall over grows by a few 1/s, a step too long by hundreds."""
    radius = np.abs(np.linalg.eigvals(recurrence(mass, damping, stiffness, springs, step))).max()
    return float(np.log(radius) / step)
