"""Reciprocity of measured frequency responses: G_ij = G_ji from motor torque to motor acceleration (Maxwell-Betti)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.frequency.periodic.response import FrequencyResponse

_STEP = 1e-3
"""Step, of the logarithm of a gain, of the second difference of a cost that is nearly quadratic in it."""


@dataclass(frozen=True)
class Reciprocity:
    """Difference G_ij − G_ji of two axes over all lines of all poses.

    `ratio` is its root mean square over its standard deviation, about one for a reciprocal system; `difference` the part of it beyond the
    standard deviation, relative to the root mean square of G_ij and G_ji; `lines` how many were compared. With the true torque of the
    second axis over the log's `gain_ratio` ± `gain_ratio_std` (1σ) times that of the first, the ratio is `corrected_ratio`, the least.
    """

    joints: tuple[str, str]
    ratio: float
    difference: float
    lines: int
    gain_ratio: float
    gain_ratio_std: float
    corrected_ratio: float


def reciprocity(responses: Sequence[FrequencyResponse]) -> tuple[Reciprocity, ...]:
    """Reciprocity of every pair of excited axes, from `responses` of the same axes in one pose or several; empty for one axis.

    Linear elasticity, gravity, rotor and link inertia and viscous friction make G symmetric whatever their values are, so this tests
    measurements without a model of the robot: G_ij and G_ji come from torques at different axes. A wrong torque gain or sign of an axis,
    swapped columns, and errors larger than their covariance break it. True torques k_j times those of the log leave G_ij k_i = G_ji k_j,
    so that the ratio of two drive gains is the one that makes the pair reciprocal (total least squares).
    """
    axes = len(responses[0].joints)
    return tuple(_pair(responses, i, j) for i in range(axes) for j in range(i + 1, axes))


def _pair(responses: Sequence[FrequencyResponse], i: int, j: int) -> Reciprocity:
    difference = np.concatenate([r.response[:, i, j] - r.response[:, j, i] for r in responses])
    size = np.concatenate([r.response[:, [i, j], [j, i]] for r in responses])
    variance = np.concatenate([_difference_variance(r, i, j) for r in responses])
    squares = np.abs(difference) ** 2
    beyond = max(0.0, float(np.mean(squares - variance)))

    def corrected(logarithm: float) -> np.ndarray:
        gain = float(np.exp(logarithm))
        rows = (r.response[:, i, j] - gain * r.response[:, j, i] for r in responses)
        scatter = np.concatenate([_difference_variance(r, i, j, gain) for r in responses])
        return np.abs(np.concatenate(list(rows))) ** 2 / scatter

    best = _minimum(lambda at: float(corrected(at).sum()))
    least, bend = float(corrected(best).mean()), _curvature(lambda at: float(corrected(at).sum()), best)
    return Reciprocity(
        (responses[0].joints[i], responses[0].joints[j]),
        float(np.sqrt(np.mean(squares / variance))),
        float(np.sqrt(beyond / np.mean(np.abs(size) ** 2))),
        len(difference),
        float(np.exp(best)),
        float(np.exp(best) * np.sqrt(max(least, 1.0) / bend)) if bend > 0 else np.inf,
        float(np.sqrt(least)),
    )


def _minimum(cost: Callable[[float], float]) -> float:
    """Logarithm of a gain within a factor of two that minimises a cost."""
    from scipy.optimize import minimize_scalar

    found: Any = minimize_scalar(cost, bounds=(-np.log(2.0), np.log(2.0)), method="bounded")
    return float(found.x)


def _curvature(cost: Callable[[float], float], at: float) -> float:
    return (cost(at + _STEP) - 2.0 * cost(at) + cost(at - _STEP)) / _STEP**2


def _difference_variance(response: FrequencyResponse, i: int, j: int, gain: float = 1.0) -> np.ndarray:
    """E|δ|² (L,) of G_ij − `gain` G_ji, whose elements are i and j of columns j and i of `vec`."""
    n = len(response.joints)
    first, second = j * n + i, i * n + j
    covariance = np.real(response.covariance)
    own = covariance[:, first, first] + gain**2 * covariance[:, second, second]
    return own - 2.0 * gain * covariance[:, first, second]
