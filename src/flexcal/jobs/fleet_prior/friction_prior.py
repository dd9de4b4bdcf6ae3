"""The friction of other robots of the model as the prior of identified dynamics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.estimation import Estimate, Parameters
from flexcal.jobs.fleet_prior.model_prior import ModelPrior
from flexcal.jobs.fleet_prior.pooled_use import PooledUse
from flexcal.jobs.fleet_prior.pooled_values import CLEAR, conflict


def with_friction(estimate: Estimate, prior: ModelPrior, terms: str) -> tuple[Estimate, PooledUse]:
    """Estimate of linear parameters, with the friction of other robots as prior of what the torques tell, and what was used of it.

    Torques are linear in the parameters, so estimate and prior are combined by their normal distributions with all correlations; a prior on
    a log scale has the mean and the variance of its log-normal distribution. Where the prior does not fit the robot, the estimate stays.
    """
    pooled = prior.friction

    def unused(why: str) -> tuple[Estimate, PooledUse]:
        return estimate, PooledUse("friction", prior.source, None, used=False, unused=why)

    if pooled is None:
        return unused("it has none")
    if pooled.condition != terms:
        return unused(
            f"it has the terms {pooled.condition}, and this robot was identified with {terms}; name the same under `dynamics: friction:`"
        )
    parameters = estimate.parameters
    own = pooled.among(n for n in pooled.names if n in parameters and estimate.std(n) is not None)
    if not own.names:
        return unused("these recordings determine none of it")
    rows = [parameters.index(name) for name in own.names]
    value = parameters.coordinates()
    covariance = estimate.covariance
    mean, std = own.natural
    measured = covariance[np.ix_(rows, rows)]
    # where the torques hardly tell a coefficient, its logarithm has no normal distribution, and the deviation is relative to the mean
    log = np.array(own.scales) == "log"
    clear = log & (value[rows] > CLEAR * np.sqrt(np.diag(measured)))
    size = np.where(log, np.where(clear, value[rows], mean), 1.0)
    off = np.where(
        clear,
        np.log(np.where(clear, value[rows], 1.0) / np.where(log, own.mean, 1.0)),
        (value[rows] - mean) / size,
    )
    slope = 1 / size
    test = conflict(own, off, measured * np.outer(slope, slope))
    if test.contradicted:
        return estimate, PooledUse("friction", prior.source, own, test, used=False)
    gain = np.linalg.solve(measured + np.diag(std**2), covariance[rows]).T
    value = value + gain @ (mean - value[rows])
    narrower = covariance - gain @ covariance[rows]
    known = dict(zip(own.names, zip(mean.tolist(), std.tolist(), strict=True), strict=True))
    items = [
        replace(item, value=float(v), prior_mean=known[item.name][0], prior_std=known[item.name][1])
        if item.name in known
        else replace(item, value=float(v))
        for item, v in zip(parameters, value, strict=True)
    ]
    combined = replace(estimate, parameters=Parameters(items), covariance=(narrower + narrower.T) / 2)
    return combined, PooledUse("friction", prior.source, own, test)
