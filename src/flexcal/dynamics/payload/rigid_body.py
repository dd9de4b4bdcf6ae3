"""Mass, centre of mass and inertia of a payload from its ten parameters, with their identifiability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.estimators import extended
from flexcal.estimation import Cone, ConicFit
from flexcal.model.parts import PSEUDO_INERTIA, Inertia, parallel_axis, pseudo_inertia
from flexcal.model.robot import MOMENTS

_FLOOR = 1e-3
"""Lower bound of a body's pseudo-inertia, relative to that of the reference body."""
_FAINT = 100.0
"""Relative standard deviation of a weak prior that keeps the problem well posed."""
_STEP = 1e-6


@dataclass(frozen=True, eq=False)
class NearestBody:
    """Ten parameters of a body, and the rise of the weighted sum of squares above its minimum."""

    parameters: np.ndarray
    rise: float


def nearest_body(parameters: np.ndarray, root: np.ndarray, unseen: np.ndarray) -> NearestBody:
    """Physical body of least weighted sum of squares about `parameters` (10,); unchanged if they are those of a body.

    `root` (10, k) has root rootᵀ = the covariance; `unseen` (10, d) are directions that the sum of squares does not feel. Raises
    `FlexcalError` as `ConicFit.solve` does.
    """
    if np.linalg.eigvalsh(np.tensordot(parameters, PSEUDO_INERTIA, 1))[0] >= 0:
        return NearestBody(parameters, 0.0)
    mass = float(parameters[0])
    reference = pseudo_inertia(extended(Inertia(mass, parameters[1:4] / mass, np.zeros((3, 3)))))
    cone = Cone(np.arange(len(parameters)), PSEUDO_INERTIA, reference, _FLOOR, _FAINT)
    size = float(np.linalg.norm(np.linalg.lstsq(root, parameters, rcond=None)[0]))
    nearest, rise = ConicFit(parameters, root, unseen, (cone,), size).solve()
    return NearestBody(nearest, rise)


def payload_from_link_frame(parameters: np.ndarray) -> np.ndarray:
    """Mass, centre of mass and the six central moments (10,) from mass, first moments and inertia about the frame."""
    mass = parameters[0]
    com = parameters[1:4] / mass
    around = parallel_axis(mass, com)[np.triu_indices(3)]
    return np.concatenate([[mass], com, parameters[4:] - around])


def link_frame_from_payload(body: np.ndarray) -> np.ndarray:
    """Inverse of `payload_from_link_frame`."""
    mass, com = body[0], body[1:4]
    around = parallel_axis(mass, com)[np.triu_indices(3)]
    return np.concatenate([[mass], mass * com, body[4:] + around])


def body_covariance(parameters: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Covariance (10, 10) of `payload_from_link_frame` to first order."""
    slope = np.empty((len(parameters), len(parameters)))
    for k in range(len(parameters)):
        step = _STEP * max(abs(parameters[k]), 1.0) * (np.arange(len(parameters)) == k)
        slope[:, k] = (
            payload_from_link_frame(parameters + step) - payload_from_link_frame(parameters - step)
        ) / (2 * step[k])
    return slope @ covariance @ slope.T


def identified_moments(body: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Mask (6,) of the moments of a body (10,) determined by intervals of half width `half` (6,).

    The moments about the axes are where none of their intervals reaches zero, which every body's are above; a product then is where its
    interval is narrower than what any body's could be, the root of the product of the two moments. Without the first, none is.
    """
    diagonal = [MOMENTS.index(key) for key in ("Ixx", "Iyy", "Izz")]
    moments = body[4:]
    if np.any(moments[diagonal] <= half[diagonal]):
        return np.zeros(6, dtype=bool)
    told = np.ones(6, dtype=bool)
    for k, key in enumerate(MOMENTS):
        if k not in diagonal:
            ends = [moments[MOMENTS.index(f"I{axis}{axis}")] for axis in key[1:]]
            told[k] = half[k] < np.sqrt(ends[0] * ends[1])
    return told
