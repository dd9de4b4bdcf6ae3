"""Instrumental-variable estimate ZᵀW χ = ZᵀY from triangular factors of [Z, W, Y], with its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.regression import Batch, BatchCovariance, parameter_rows, score_covariance, triangular
from flexcal.errors import FlexcalError

_WEAKEST = 1e-3
"""Least correlation of an instrument with its regressor, over all directions of the parameters."""


@dataclass(frozen=True, eq=False)
class InstrumentalFit:
    """`values` (p,) of all parameters; the covariance of the kept ones; the weighted sum of squares; the weakest correlation."""

    values: np.ndarray
    covariance: BatchCovariance
    cost: float
    weakest: float


def instrumental_fit(
    experiments: Sequence[Sequence[Batch]],
    column_indices: Sequence[np.ndarray],
    noise: Sequence[float],
    start: np.ndarray,
    kept: Sequence[int],
) -> InstrumentalFit:
    """Instrumental-variable estimate from batches whose factors are [Z, W, Y].

    Every joint has its `column_indices` twice (instruments, regressor) and Y, divided by the `noise` of its subsystem. R of [Z, W, Y]
    stands for the products: R_ZW χ = R_ZY, whose condition is not squared. Parameters that are not `kept` stay at `start` (p,). Raises
    `FlexcalError` where an instrument does not correlate.
    """
    size, joints = len(kept), len(column_indices)
    stack, equations = [], 0
    for number, batches in enumerate(experiments):
        for joint, own in enumerate(column_indices):
            rows = np.vstack([batch.factors[joint] for batch in batches])
            stack.append(triangular(rows @ (_columns(own, kept, start) / noise[number * joints + joint])))
        equations += joints * sum(batch.rows for batch in batches)
    whole = np.vstack(stack)
    norms = np.linalg.norm(whole, axis=0)
    scale = 1.0 / np.where(norms > 0, norms, 1.0)
    instruments, regressors, right = np.split(triangular(whole * scale), [size, 2 * size], axis=1)
    weakest = float(np.linalg.svd(np.linalg.qr(regressors)[0][:size], compute_uv=False)[-1])
    if not weakest > _WEAKEST:
        raise FlexcalError(
            "E-DYN-006",
            f"an instrumental variable is hardly correlated with its column (correlation {weakest:.1g}); record longer and with "
            "more excitation, with a "
            "heavier payload where gains are sought, or check `controller:` in robot.yaml.",
        )
    root = scale[size:-1, None] * np.linalg.inv(regressors[:size])
    parameters = start.copy()
    parameters[kept] += root @ right[:size, 0] / scale[-1]
    whiten = scale[:size, None] * np.linalg.inv(instruments[:size])
    cost = float(np.sum((whole[:, size:] @ np.append(start[kept] - parameters[kept], 1.0)) ** 2))
    covariance = score_covariance(
        experiments,
        noise,
        [
            np.vstack([parameter_rows(whiten, kept, own), np.zeros((len(own) + 1, size))])
            for own in column_indices
        ],
        [np.concatenate([np.zeros(len(own)), -parameters[own], [1.0]]) for own in column_indices],
        root,
        cost / (equations - size),
    )
    return InstrumentalFit(parameters, covariance, cost, weakest)


def _columns(column_indices: np.ndarray, kept: Sequence[int], start: np.ndarray) -> np.ndarray:
    """Matrix (2 m + 1, 2 k + 1) from a joint's [Z, W, Y] to the kept columns of Z, those of W, and Y less what `start` explains."""
    m, size = len(column_indices), len(kept)
    chosen = parameter_rows(np.eye(size), kept, column_indices)
    mapping = np.zeros((2 * m + 1, 2 * size + 1))
    mapping[:m, :size] = mapping[m : 2 * m, size : 2 * size] = chosen
    mapping[m : 2 * m, -1] = -start[column_indices]
    mapping[-1, -1] = 1.0
    return mapping
