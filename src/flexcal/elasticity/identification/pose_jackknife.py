"""Scatter of the estimate from pose to pose, by leaving each pose out (jackknife)."""

from __future__ import annotations

import numpy as np

from flexcal.elasticity.identification.fit import ResponseFit


def jackknife_std(fit: ResponseFit) -> np.ndarray | None:
    """Standard deviations (p,), in estimation coordinates, by how far the optimum of `fit` moves without each of its poses; None of one.

    To first order, with the errors that are common to all poses as further unknowns (Cook & Weisberg 1982 of the single case). Model errors
    that are coherent over the lines of a pose show in it, whatever their form is; those that all poses have alike do not.
    """
    poses = fit.residual.poses
    if len(poses) < 2:
        return None
    residual, columns = fit.residual.linearise(fit.x)
    if fit.error is not None:
        common = fit.error.common
        residual, columns = fit.error.by_pose(residual), fit.error.by_pose(columns)
        columns = np.hstack([columns, common.basis * np.sqrt(1 / (1 - common.shrink) ** 2 - 1)])
    count, size = len(fit.x), columns.shape[1]
    known = fit.problem.prior_rows()
    information, score = np.eye(size), np.zeros(size)
    information[:count, :count] = known.T @ known
    score[:count] = known.T @ (known @ (fit.x - fit.problem.parameters.prior_mean()))
    ends = np.cumsum([2 * pose.measured.size for pose in poses])[:-1]
    parts = [
        (part.T @ part, part.T @ own)
        for part, own in zip(np.split(columns, ends), np.split(residual, ends), strict=True)
    ]
    information += sum(square for square, _ in parts)
    score += sum(own for _, own in parts)
    moved = np.stack([np.linalg.solve(information - square, own - score)[:count] for square, own in parts])
    return np.sqrt((len(poses) - 1) * np.var(moved, axis=0))
