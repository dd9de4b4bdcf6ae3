"""Predicted accuracy of joint zeros."""

from __future__ import annotations

import numpy as np

from flexcal.design.poses.geometry_sensitivity import BaseSensitivity

UNKNOWN_ZERO = 5e-3
"""Standard deviation, rad or m, of a joint zero before anything is measured."""


def zero_stds(base: BaseSensitivity, chosen: np.ndarray) -> dict[str, float]:
    """Standard deviation of every joint's zero, rad or m, after measuring the candidates `chosen`.

    Beforehand zeros are known to `UNKNOWN_ZERO`, all else within the tolerances, so that what the readings cannot tell from a zero counts:
    with p ~ N(0, S²), readings of G p and their covariance C, Σ = S² - S² Gᵀ (G S² Gᵀ + C)⁻¹ G S².
    """
    names = base.identifiability.names
    zeros = [k for k, name in enumerate(names) if name.endswith(".offset") and not name.startswith("tool.")]
    size = base.tolerance.copy()
    size[zeros] = UNKNOWN_ZERO
    jacobian = base.sensitivity.jacobian[chosen].reshape(-1, len(base.scale)) / base.scale
    spread = base.identifiability.regrouping * size
    # in units of the prior, rows of the readings by all parameters
    whole = jacobian @ spread
    values, vectors = np.linalg.eigh(whole.T @ whole)
    left = 1 / np.sqrt(1 + np.maximum(values, 0.0))
    stds = np.linalg.norm(vectors[zeros] * left, axis=1) * UNKNOWN_ZERO
    return {names[k].removesuffix(".offset"): float(std) for k, std in zip(zeros, stds, strict=True)}
