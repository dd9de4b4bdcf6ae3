"""Error sources: reduction of the predicted tool error by kind of parameter."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.error_model import angular_scatter, joint_rotation_jacobian
from flexcal.calibration.measurement import (
    Propagation,
    covariance_root,
    moving_parameters,
    predict_measurements,
    unknown_sides,
)
from flexcal.data.poses import PoseSet
from flexcal.model.robot import HYSTERESIS, MASS_AND_COM

PARAMETERS = ("geometry", "backlash", HYSTERESIS, "springs", "link masses", "payload", "instrument's place")
REPEATABILITY, MODEL_ERROR = "repeatability", "model error"
SOURCES = (*PARAMETERS, REPEATABILITY, MODEL_ERROR)


def source_of(name: str) -> str:
    """Kind of a parameter that moves a point, one of `PARAMETERS`."""
    owner, _, key = name.rpartition(".")
    if owner.startswith("station."):
        return "instrument's place"
    if owner == "payload":
        return "payload"
    if key in ("stiffness", "hardening"):
        return "springs"
    if key in MASS_AND_COM:
        return "link masses"
    return key if key in ("backlash", HYSTERESIS) else "geometry"


def error_sources(reach: Propagation, q: np.ndarray) -> dict[str, np.ndarray]:
    """Fraction by which the variance of the tool's error at poses `q` (N, n) falls if one kind of parameter is known exactly.

    (N,) between 0 and 1 for each of the `SOURCES` that were estimated; the variance of the others given these is Gaussian conditioning.
    Hysteresis is known exactly where its width is and the side from which a joint comes. Where kinds are correlated the shares do not add
    up to one.
    """
    model, size = reach.model, len(q)
    names = [n for n in moving_parameters(model) if model.posterior.determines(n)]
    root = covariance_root(model, names)
    at = predict_measurements(model, PoseSet.unmeasured(q, reach.target, reach.station, 1.0), jacobians=True)
    roots = at.jacobian(names) @ root
    turned = ((joint_rotation_jacobian(at) * angular_scatter(model)) ** 2).sum(axis=(1, 2))
    scatter = {
        HYSTERESIS: (unknown_sides(at) ** 2).sum(axis=(1, 2)),
        REPEATABILITY: 3 * model.value("scatter.robot") ** 2 + turned,
        MODEL_ERROR: np.full(size, 3 * model.value("scatter.model") ** 2),
    }
    variance = (roots**2).sum(axis=(1, 2)) + sum(scatter.values())
    kinds = np.array([source_of(name) for name in names])
    shares = {}
    for kind in PARAMETERS:
        if (kinds == kind).any():
            # what knowing the kind takes away: the part of the root's columns that its rows span
            basis = np.linalg.svd(root[kinds == kind] / _sizes(root[kinds == kind]), full_matrices=False)[2]
            shares[kind] = ((roots @ basis.T) ** 2).sum(axis=(1, 2)) / variance
    return shares | {
        kind: own / variance + shares.get(kind, 0.0) for kind, own in scatter.items() if own.any()
    }


def _sizes(rows: np.ndarray) -> np.ndarray:
    return np.linalg.norm(rows, axis=1, keepdims=True)
