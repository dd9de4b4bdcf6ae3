"""Bias of an identified drive stiffness by position noise: errors in variables (Fuller 1987, section 1.1)."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.estimators import noise_levels, weighted_system
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate


def stiffness_attenuation(data: RegressionData, estimate: Estimate) -> dict[str, float]:
    """Largest relative attenuation of the identified stiffnesses of drives and bearings, by name, due to noise of q - θ.

    Noise of size σ_e in N rows of a column of which the others leave t makes K smaller by K N σ_e² / ‖t‖². It also stands in the
    residual of its equation, K σ_e ≤ σ, so that the share is at most N (σ / (K ‖t‖))²: no size of the noise need be known.
    Raises `FlexcalError` as `noise_levels` does.
    """
    names = data.names
    stiffnesses = [name for name in names if name.endswith(".stiffness")]
    if not stiffnesses:
        return {}
    matrix = weighted_system(data, noise_levels(data)).matrix
    seen = [i for i, known in enumerate(estimate.identifiable) if known]
    norms = np.linalg.norm(matrix, axis=0)
    attenuation: dict[str, float] = {}
    for name in stiffnesses:
        own = names.index(name)
        if own not in seen:
            continue
        others = [i for i in seen if i != own]
        basis = np.linalg.qr(matrix[:, others] / norms[others])[0]
        left = matrix[:, own] - basis @ (basis.T @ matrix[:, own])
        rows = sum(s.triangle.rows for s in data.subsystems if own in s.column_indices)
        attenuation[name] = rows / float(estimate.values[name] ** 2 * (left @ left))
    return attenuation
