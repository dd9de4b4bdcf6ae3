"""Rank, covariance and goodness of fit at an optimum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.identifiability import Identifiability, analyse
from flexcal.estimation.levenberg_marquardt import Optimum
from flexcal.estimation.objective import Objective
from flexcal.estimation.parameter import Parameters

LOG_STD_LIMIT = 0.5 / 1.96
"""A parameter on a log scale with a larger posterior standard deviation s is not identifiable: its 95 % interval reaches beyond a factor
of exp(0.5) = 1.65. Responses are nearly linear in a compliance, whose interval (1 ± 1.96 s) / c then includes half of it: at twice the
stiffness s is twice as large, and the data cannot tell that end of the interval from rigid. Intervals of the logarithm do not cover
there."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """`root` (p, k): the posterior covariance is root rootᵀ; `effective` is the number of parameters the data determine."""

    identifiability: Identifiability
    root: np.ndarray
    effective: float
    chi2: float
    rows: float


def uncertainty(
    objective: Objective, optimum: Optimum, prefer: Sequence[str], tolerance: float
) -> Uncertainty:
    """Uncertainty from the weighted rows and the prior's, by pivoted QR; the kept parameters' covariance is R₁₁⁻¹R₁₁⁻ᵀ, the rest zero."""
    names = objective.problem.parameters.names
    factor = objective.triangular(optimum.x, optimum.residual, optimum.jacobian, optimum.weights)[0]
    identifiability = analyse(factor, names, prefer=prefer, tolerance=tolerance)
    kept = list(identifiability.kept)
    scale = 1.0 / np.linalg.norm(factor[:, kept], axis=0)
    triangle = np.linalg.qr(factor[:, kept] * scale, mode="r")
    root = np.zeros((len(names), len(kept)))
    root[kept] = scale[:, None] * np.linalg.inv(triangle)
    weights = optimum.weights[objective.grouping.number]
    return Uncertainty(
        identifiability=identifiability,
        root=root,
        effective=len(kept) - float(np.sum((objective.prior_rows @ root) ** 2)),
        chi2=float(np.sum(weights * optimum.residual**2)),
        rows=float(np.sum(weights)),
    )


def is_log_identified(parameters: Parameters, covariance: np.ndarray) -> tuple[bool, ...]:
    """For every parameter whether `covariance` (p, p) leaves it known to `LOG_STD_LIMIT`; always so on a linear scale."""
    stds = np.sqrt(np.diag(covariance))
    return tuple(
        item.scale == "linear" or bool(std <= LOG_STD_LIMIT)
        for item, std in zip(parameters, stds, strict=True)
    )


def sandwich(objective: Objective, optimum: Optimum, at: Uncertainty) -> np.ndarray:
    """Covariance (p, p) that holds when the whitening is wrong within or between groups (Huber 1967, White 1980).

    Bread from the posterior's factor, meat from the scatter of the groups' scores with the factor
    G/(G − 1) · (m − 1)/(m − k) for G groups and k effective parameters. The prior is taken as it is stated. For robust
    losses the bread is corrected by the mean curvature of the loss over its mean weight.
    Raises FlexcalError with no more groups than effective parameters.
    """
    groups, rows = objective.grouping.labels.size, optimum.residual.size
    if groups <= at.effective + 1:
        raise FlexcalError(
            "E-FIT-030",
            f"A sandwich covariance needs more groups than parameters: {groups} groups for "
            f"{at.effective:.1f} effective parameters; use finer groups or covariance='posterior'.",
        )
    weights = optimum.weights[objective.grouping.number]
    scores = objective.grouping.sums(optimum.jacobian @ at.root * (weights * optimum.residual)[:, None])
    scores *= np.sqrt(groups / (groups - 1.0) * (rows - 1.0) / (rows - at.effective))
    prior = objective.prior_rows @ at.root
    meat = np.linalg.qr(np.vstack([scores, prior]), mode="r")
    factor = _curvature_over_weight(objective, optimum)
    # In the basis of `root` the bread is the identity: data V, prior P, V + P = I; corrected it is factor·V + P.
    values, vectors = np.linalg.eigh(prior.T @ prior)
    bread = 1.0 / (factor * (1.0 - values) + values)
    half = meat @ (vectors * bread) @ vectors.T @ at.root.T
    return half.T @ half


def _curvature_over_weight(objective: Objective, optimum: Optimum) -> float:
    """Mean over rows of the loss's second derivative, isotropic within a group, over the mean weight."""
    norms, sizes = objective.grouping.norms(optimum.residual), objective.grouping.sizes
    curvature = objective.loss.curvature(norms, objective.thresholds)
    mean = float(np.sum(curvature + (sizes - 1.0) * optimum.weights)) / float(np.sum(sizes * optimum.weights))
    return max(mean, 0.1)
