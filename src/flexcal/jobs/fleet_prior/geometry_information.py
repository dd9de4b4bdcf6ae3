"""What one calibration tells of the robot itself, wherever it stood and whatever it carried."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.estimation import Estimate, Measured
from flexcal.model.parts import LOOP
from flexcal.model.robot import GEOMETRY, LATERAL, ORIGIN, RATIO, RobotModel

_RANK = 1e-11
"""Relative eigenvalue of information, in plausible sizes, below which it is a rounding error."""
_TOLD = 1e-6
"""Least information on a combination, in plausible sizes, that counts."""
_OF_ROBOT = (*GEOMETRY, *ORIGIN, *LOOP, *LATERAL, "gravity_compliance", "backlash")


def is_geometric_error(model: RobotModel, name: str) -> bool:
    """Whether a parameter is a geometric error of the arm: not of tool, target or instrument, and no wave, spring or inertia."""
    owner, _, key = name.rpartition(".")
    owned = owner in model.joint_names or owner.startswith("loop.")
    return owned and (key in _OF_ROBOT or key.startswith(RATIO))


def geometry_information(
    estimate: Estimate, names: Sequence[str], cell: Sequence[str], sizes: np.ndarray
) -> Measured:
    """What the measurements of a calibration tell of the parameters `names`, as independent combinations of variance one.

    The estimate of kept parameters k with covariance P is that of k + C (d - d₀), where d are the parameters that it dropped or held at d₀:
    its information is (I C)ᵀ P⁻¹ (I C). Declared standard deviations, and the plausible sizes of parameters that were held, are taken out
    of it; springs, inertia and waves are integrated out with what the calibration had as their prior, and the parameters of the `cell` with
    none (a Schur complement). `sizes` (p,) are plausible sizes of the parameters.
    """
    parameters, dropped = estimate.parameters, [item.name for item in estimate.dropped]
    every = [*names, *(name for name in cell if name in parameters)]
    place = {name: k for k, name in enumerate(every)}
    told = [name for name in every if name in parameters and name not in dropped]
    told = [name for name in told if estimate.covariance[parameters.index(name), parameters.index(name)] > 0]
    rows = [parameters.index(name) for name in told]
    std = np.sqrt(np.diag(estimate.covariance)[rows])
    items = [parameters[k] for k in rows]
    inverse = np.linalg.inv(estimate.covariance[np.ix_(rows, rows)] / np.outer(std, std))
    # a parameter that was held has its plausible size as its variance, and has been found at its start
    held = [not estimate.identifiable[k] and np.isinf(p.prior_std) for k, p in zip(rows, items, strict=True)]
    prior = np.where(held, 1.0, (std / np.array([p.prior_std for p in items])) ** 2)
    value = np.array([p.value for p in items])
    mean = np.array([p.value if p.prior_mean is None else p.prior_mean for p in items])
    right = inverse @ (value / std) - prior * np.where(held, value, mean) / std
    information = inverse - np.diag(prior)
    across, start = np.zeros((len(told), len(every))), np.zeros(len(told))
    own = {name: k for k, name in enumerate(told)}
    across[range(len(told)), [place[name] for name in told]] = 1.0
    for item in estimate.dropped:
        for name, coefficient in item.absorbed_by:
            if name in own and item.name in place:
                across[own[name], place[item.name]] = coefficient
                start[own[name]] += coefficient * parameters[item.name].value
    unit = np.concatenate([sizes, np.ones(len(every) - len(names))])
    across = across * unit / std[:, None]
    matrix = across.T @ information @ across
    vector = across.T @ (right + information @ (start / std))
    return independent_combinations(*_without(matrix, vector, len(names)), sizes)


def _without(matrix: np.ndarray, vector: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Information (p, p) and right-hand side (p,) of the first `count` parameters, the others integrated out."""
    own, other = slice(None, count), slice(count, None)
    size = np.sqrt(np.maximum(np.diag(matrix)[other], 0.0))
    size = np.where(size > 0, size, 1.0)
    inner = np.linalg.pinv(matrix[other, other] / np.outer(size, size), rcond=_RANK, hermitian=True)
    across = matrix[own, other] / size
    return matrix[own, own] - across @ inner @ across.T, vector[own] - across @ inner @ (vector[other] / size)


def independent_combinations(matrix: np.ndarray, vector: np.ndarray, sizes: np.ndarray) -> Measured:
    """Combinations of parameters with independent errors of variance 1 that tell as much as an information `matrix` (p, p) and right-hand
    side (p,), both in units of `sizes` (p,).
    """
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    kept = values > max(_TOLD, _RANK * float(values.max(initial=0.0)))
    root = np.sqrt(values[kept])
    return Measured((vectors[:, kept] * root).T / sizes, vectors[:, kept].T @ vector / root)
