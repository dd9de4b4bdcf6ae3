"""Propagation of the parameter covariance to derived quantities."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np

from flexcal.model.robot.robot_model import RobotModel


def propagated_covariance_root(
    model: RobotModel, result: Callable[[RobotModel], np.ndarray], owners: Collection[str] | None = None
) -> np.ndarray:
    """Square root (size, k) of the first-order covariance of `result` (size,) over the posterior of `model`.

    Its k columns are what one standard deviation in each independent direction of the estimated parameters changes, by central
    differences over one standard deviation of each; k = 0 where nothing was estimated. The result depends on parameters of the joints,
    points and other `owners` alone, where these are given.
    """
    posterior = model.posterior
    names = posterior.parameters.names
    if owners is not None:
        names = [name for name in names if name.rpartition(".")[0] in owners]
    known = [name for name in names if posterior.determines(name)]
    if not known:
        return np.zeros((len(result(model)), 0))
    parameters, covariance = posterior.parameters.subset(known), posterior.marginal(known)
    std, centre = np.sqrt(np.diag(covariance)), parameters.coordinates()
    slopes = []
    for step in np.diag(std):
        sides = [
            dict(zip(known, parameters.natural(centre + sign * step).tolist(), strict=True))
            for sign in (1, -1)
        ]
        above, below = (result(model.with_values(values)) for values in sides)
        slopes.append((above - below) / 2)
    values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
    return np.column_stack(slopes) @ (vectors * np.sqrt(np.clip(values, 0, None)))
