"""The stiffness of other robots of the model as the prior of a robot."""

from __future__ import annotations

import numpy as np

from flexcal.estimation import Estimate
from flexcal.jobs.fleet_prior.pooled_values import PoolConflict, PooledValues, conflict
from flexcal.model.robot import RobotModel

_LEARNT = 0.8
"""Standard deviation, relative to that of the prior, from which the measurements say little of a stiffness."""


def with_stiffness(model: RobotModel, pooled: PooledValues | None) -> tuple[RobotModel, PooledValues | None]:
    """Robot with the pooled stiffness, and its standard deviation as prior, of every declared spring that was not identified; and the
    pooled values that it took, None for none.
    """
    if pooled is None:
        return model, None
    free = pooled.among(n for n in pooled.names if n in model.values and not model.posterior.determines(n))
    if not free.names:
        return model, None
    values = dict(zip(free.names, free.mean.tolist(), strict=True))
    return model.with_values(values).with_priors(dict(zip(free.names, free.std.tolist(), strict=True))), free


def stiffness_conflict(pooled: PooledValues, estimate: Estimate) -> PoolConflict | None:
    """Test of an estimate that was made without the pooled stiffnesses; None where it tells of none."""
    own = pooled.among(n for n in pooled.names if n in estimate.parameters and estimate.std(n) is not None)
    return _tested(own, estimate, estimate.marginal(own.names)[1]) if own.names else None


def conflict_after(pooled: PooledValues, estimate: Estimate) -> PoolConflict | None:
    """Test of an estimate that had the pooled stiffnesses as its prior, by those that the measurements tell; None where they tell of none.

    Were the robot one of the others, the estimate would deviate from the pooled mean by no more than the next robot does.
    """
    own = pooled.among(
        name
        for name, before in zip(pooled.names, pooled.std, strict=True)
        if name in estimate.parameters and 0 < _std(estimate, name) < _LEARNT * before
    )
    return _tested(own, estimate, np.zeros((len(own.names), len(own.names)))) if own.names else None


def _tested(own: PooledValues, estimate: Estimate, covariance: np.ndarray) -> PoolConflict:
    items = [estimate.parameters[name] for name in own.names]
    off = np.array([item.coordinate(item.value) for item in items]) - np.log(own.mean)
    return conflict(own, off, covariance)


def _std(estimate: Estimate, name: str) -> float:
    number = estimate.parameters.index(name)
    return float(np.sqrt(estimate.covariance[number, number]))
