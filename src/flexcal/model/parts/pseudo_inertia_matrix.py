"""Pseudo-inertia matrix of a link, positive definite for physically consistent inertials (Wensing, Kim & Slotine 2018)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.model.parts.inertia import LINK_PARAMETERS, Inertia, parallel_axis


def _basis() -> np.ndarray:
    result = np.zeros((len(LINK_PARAMETERS), 4, 4))
    for matrix, key in zip(result, LINK_PARAMETERS, strict=True):
        if key == "mass":
            matrix[3, 3] = 1.0
            continue
        places = ["xyz".index(axis) for axis in key[-2:] if axis in "xyz"]
        row, column = places[0], places[-1]
        if key.startswith("mc_"):
            matrix[row, 3] = matrix[3, row] = 1.0
        elif row == column:
            matrix[:3, :3] = 0.5 * np.eye(3)
            matrix[row, row] -= 1.0
        else:
            matrix[row, column] = matrix[column, row] = -1.0
    return result


PSEUDO_INERTIA = _basis()
"""Basis (10, 4, 4): derivative of [[Σ, mc], [mcᵀ, m]], Σ = ½ tr(I) 1 - I at the joint frame, by each parameter in `LINK_PARAMETERS`."""


def pseudo_inertia(link: Inertia) -> np.ndarray:
    """Pseudo-inertia matrix [[Σ, mc], [mcᵀ, m]] (4, 4) of a link at its joint frame, in kg m², kg m and kg."""
    at_joint = link.inertia + parallel_axis(link.mass, link.com)
    result = np.empty((4, 4))
    result[:3, :3] = 0.5 * np.trace(at_joint) * np.eye(3) - at_joint
    result[:3, 3] = result[3, :3] = link.mass * link.com
    result[3, 3] = link.mass
    return result


def is_physically_consistent(values: Mapping[str, float], link: str) -> bool:
    """Whether the ten named parameters of a link are those of a physical body: positive mass and strict triangle inequalities."""
    own = np.array([values[f"{link}.{key}"] for key in LINK_PARAMETERS])
    return bool(np.linalg.eigvalsh(np.tensordot(own, PSEUDO_INERTIA, 1))[0] > 0)
