"""Reciprocity of measured frequency responses: G_ij = G_ji from motor torque to motor acceleration (Maxwell-Betti)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.frequency.periodic.response import FrequencyResponse


@dataclass(frozen=True)
class Reciprocity:
    """Difference G_ij − G_ji of two axes over all lines of all poses.

    `ratio` is its root mean square over its standard deviation, about one for a reciprocal system; `difference` the part of it beyond the
    standard deviation, relative to the root mean square of G_ij and G_ji; `lines` how many were compared.
    """

    joints: tuple[str, str]
    ratio: float
    difference: float
    lines: int


def reciprocity(responses: Sequence[FrequencyResponse]) -> tuple[Reciprocity, ...]:
    """Reciprocity of every pair of excited axes, from `responses` of the same axes in one pose or several; empty for one axis.

    Linear elasticity, gravity, rotor and link inertia and viscous friction make G symmetric whatever their values are, so this tests
    measurements without a model of the robot: G_ij and G_ji come from torques at different axes. A wrong torque gain or sign of an axis,
    swapped columns, and errors larger than their covariance break it.
    """
    axes = len(responses[0].joints)
    return tuple(_pair(responses, i, j) for i in range(axes) for j in range(i + 1, axes))


def _pair(responses: Sequence[FrequencyResponse], i: int, j: int) -> Reciprocity:
    difference = np.concatenate([r.response[:, i, j] - r.response[:, j, i] for r in responses])
    size = np.concatenate([r.response[:, [i, j], [j, i]] for r in responses])
    variance = np.concatenate([_difference_variance(r, i, j) for r in responses])
    squares = np.abs(difference) ** 2
    beyond = max(0.0, float(np.mean(squares - variance)))
    return Reciprocity(
        (responses[0].joints[i], responses[0].joints[j]),
        float(np.sqrt(np.mean(squares / variance))),
        float(np.sqrt(beyond / np.mean(np.abs(size) ** 2))),
        len(difference),
    )


def _difference_variance(response: FrequencyResponse, i: int, j: int) -> np.ndarray:
    """E|δ|² (L,) of G_ij − G_ji, whose elements are i and j of columns j and i of `vec`."""
    n = len(response.joints)
    first, second = j * n + i, i * n + j
    covariance = np.real(response.covariance)
    own = covariance[:, first, first] + covariance[:, second, second]
    return own - 2.0 * covariance[:, first, second]
