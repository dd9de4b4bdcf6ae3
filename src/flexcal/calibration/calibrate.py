"""Stage 2: the geometry from measured points, with the elastic deflection taken into account (P1 §3 and §5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.calibration.elastic_prior import ElasticPrior
from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.flanks import ambiguous_poses, require_both_flanks
from flexcal.calibration.prediction import predict
from flexcal.calibration.registration import register
from flexcal.calibration.terms import geometric_parameters, tolerances
from flexcal.data import PoseSet
from flexcal.errors import FlexcalError
from flexcal.estimation import (
    Dropped,
    Estimate,
    Identifiability,
    Loss,
    Parameter,
    Parameters,
    Problem,
    analyse,
    solve,
)
from flexcal.model import RobotModel

_FLANK_PASSES = 4
_STRUCTURAL_POSES = 100


@dataclass(frozen=True, eq=False)
class Calibration:
    """A fitted geometry.

    `model` is the calibrated robot; `estimate` holds all geometric parameters (dropped ones at their start, not identifiable) and,
    re-estimated with their prior, stiffness and inertia; `identifiability` is that of the kinematic Jacobian; `residuals` (N, 3) m,
    measured minus predicted; `flank` (N, n); `ambiguous` (N,) poses whose flank is not certain; `terms` those fitted.
    """

    model: RobotModel
    estimate: Estimate
    identifiability: Identifiability
    poses: PoseSet
    residuals: np.ndarray
    flank: np.ndarray
    ambiguous: np.ndarray
    terms: tuple[str, ...]

    @property
    def errors(self) -> ErrorStatistics:
        """How far the calibrated robot is from the points it was fitted to."""
        return ErrorStatistics.of(self.residuals)


def calibrate(
    model: RobotModel,
    poses: PoseSet,
    *,
    stiffness: Estimate | None = None,
    terms: Sequence[str] = ("kinematic", "backlash"),
    elastic: bool = True,
    elasticity: Literal["reestimated", "marginalised"] = "reestimated",
    secant_scale: float = 0.0,
    loss: Loss | Literal["squares", "huber", "cauchy"] = "squares",
    progress: Callable[[int, float], None] | None = None,
) -> Calibration:
    """Fit the geometry of `model` to measured points, Levenberg-Marquardt on the vector error (28) with the Jacobian (29).

    Rank and dropped parameters come from the kinematic Jacobian at zero deflection. `stiffness` is the estimate of stage 1: its
    posterior enters either by re-estimating those parameters with it as a prior, or, marginalised, through the residual covariance
    R + J Σ Jᵀ; the two agree to first order. `secant_scale` lets each drive's stiffness under gravity differ from the tangent one.
    Without `elastic` the arm is fitted as rigid. `loss` "cauchy" finds outliers.

    Raises `FlexcalError` for fewer rows than identifiable parameters, poses that are all equal, joints that do not move and a backlash
    seen from one flank only.
    """
    _check_variety(model, poses)
    start = register(model, poses, predict(_with_identity_stations(model), poses, elastic=elastic).position)
    if "backlash" in terms:
        require_both_flanks(model, predict(start, poses, elastic=elastic).rest.flank)
    geometric = geometric_parameters(start, poses, terms)
    found = _kinematic_identifiability(start, poses, geometric)
    _require_enough(start, poses, geometric, found)
    kept = geometric.subset(found.kept_names)
    prior = (
        ElasticPrior.of(start, poses, stiffness, secant_scale=secant_scale)
        if elastic
        else ElasticPrior(Parameters(), np.zeros((0, 0)))
    )
    flank = predict(start, poses, elastic=elastic).rest.flank
    for _ in range(_FLANK_PASSES):
        problem = _problem(start, poses, kept, prior, flank, elastic, elasticity)
        estimate = solve(problem, loss=loss, progress=progress)
        fitted = start.with_values(estimate.values)
        after = predict(fitted, poses, elastic=elastic, jacobians=True)
        if (after.rest.flank == flank).all():
            break
        flank = after.rest.flank
        if "backlash" in terms:
            require_both_flanks(model, flank)
    full = _with_held(estimate, _held(geometric, found.dropped, fitted, poses), found.dropped)
    return Calibration(
        model=fitted.with_estimate(full),
        estimate=full,
        identifiability=found,
        poses=poses,
        residuals=poses.position - after.position,
        flank=flank,
        ambiguous=ambiguous_poses(after, _posterior(estimate, prior)),
        terms=tuple(terms),
    )


def _check_variety(model: RobotModel, poses: PoseSet) -> None:
    if len(poses.q) < 2:
        raise FlexcalError(f"there are {len(poses.q)} poses; a calibration needs many.")
    spread = np.ptp(poses.q, axis=0)
    if spread.max() < 1e-6:
        raise FlexcalError(
            f"all {len(poses.q)} poses are the same; measure poses that differ in every joint."
        )
    still = [joint.name for joint, range_ in zip(model.joints, spread, strict=True) if range_ < 1e-6]
    if still:
        raise FlexcalError(
            f"{', '.join(still)} never moves in the {len(poses.q)} poses; move every joint, or its errors cannot be seen."
        )


def _with_identity_stations(model: RobotModel) -> RobotModel:
    return replace(model, station=np.zeros_like(model.station))


def _kinematic_identifiability(model: RobotModel, poses: PoseSet, parameters: Parameters) -> Identifiability:
    """Rank at zero deflection with both flanks as they are: exact derivatives leave a gap of many decades (METHODS)."""
    straight = predict(model, poses, elastic=False, jacobians=True)
    columns = straight.jacobian(parameters.names).reshape(-1, len(parameters))
    preferred = [name for name in parameters.names if name.endswith("backlash")]
    return analyse(columns, parameters.names, scale=tolerances(parameters), prefer=preferred)


def _require_enough(
    model: RobotModel, poses: PoseSet, parameters: Parameters, found: Identifiability
) -> None:
    """Raise `FlexcalError` where the rows are too few for the parameters that many random poses would determine."""
    rows = 3 * len(poses)
    if found.rank < rows:
        return
    limits = np.array([(max(j.lower, -np.pi), min(j.upper, np.pi)) for j in model.joints])
    many = poses.subset(np.resize(np.arange(len(poses)), _STRUCTURAL_POSES))
    spread = np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], many.q.shape)
    rank = _kinematic_identifiability(model, replace(many, q=spread), parameters).rank
    raise FlexcalError(
        f"{len(poses)} poses give {rows} coordinates, too few for {rank} identifiable parameters; "
        f"measure at least {rank // 3 + 1} poses, better three times as many."
    )


def _problem(
    start: RobotModel,
    poses: PoseSet,
    kept: Parameters,
    prior: ElasticPrior,
    flank: np.ndarray,
    elastic: bool,
    elasticity: str,
) -> Problem:
    joint = elasticity == "reestimated"
    parameters = kept + prior.parameters if joint else kept
    groups = np.repeat(np.arange(len(poses.q)), 3)
    whitener = None
    if not joint and len(prior.parameters):
        at = predict(start, poses, flank=flank, elastic=elastic, jacobians=True)
        slopes = prior.parameters.natural_slope(prior.parameters.coordinates())
        columns = at.jacobian(prior.parameters.names).reshape(-1, len(prior.parameters)) * slopes
        covariance = np.diag(poses.sigma.ravel() ** 2) + columns @ prior.covariance @ columns.T
        whitener = np.linalg.cholesky(covariance)

    def whitened(rows: np.ndarray) -> np.ndarray:
        if whitener is None:
            return rows / (poses.sigma.ravel() if rows.ndim == 1 else poses.sigma.ravel()[:, None])
        from scipy.linalg import solve_triangular

        return solve_triangular(whitener, rows, lower=True)

    def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = dict(zip(parameters.names, parameters.natural(x), strict=True))
        at = predict(start.with_values(values), poses, flank=flank, elastic=elastic, jacobians=True)
        columns = at.jacobian(parameters.names).reshape(-1, len(parameters)) * parameters.natural_slope(x)
        return whitened((poses.position - at.position).ravel()), -whitened(columns)

    def residual(x: np.ndarray) -> np.ndarray:
        values = dict(zip(parameters.names, parameters.natural(x), strict=True))
        at = predict(start.with_values(values), poses, flank=flank, elastic=elastic)
        return whitened((poses.position - at.position).ravel())

    covariance = None
    if joint and len(prior.parameters):
        covariance = np.diag(np.full(len(parameters), np.inf))
        covariance[len(kept) :, len(kept) :] = prior.covariance
    return Problem(parameters, linearise, residual, covariance, groups)


def _held(
    geometric: Parameters, dropped: tuple[Dropped, ...], fitted: RobotModel, poses: PoseSet
) -> Parameters:
    """What the fit does not move but a robot needs: dropped parameters, and the rotation of the first station."""
    turns = [f"station.{station}.{key}" for station in poses.stations for key in ("rx", "ry", "rz")]
    rest = Parameters(Parameter(n, "rad", fitted.value(n)) for n in turns if n not in geometric)
    return Parameters(geometric[d.name] for d in dropped) + rest


def _with_held(estimate: Estimate, held: Parameters, dropped: tuple[Dropped, ...]) -> Estimate:
    """The estimate with parameters added that stay at their values, not identifiable."""
    size = len(estimate.parameters)
    covariance = np.zeros((size + len(held), size + len(held)))
    covariance[:size, :size] = estimate.covariance
    return replace(
        estimate,
        parameters=estimate.parameters + held,
        covariance=covariance,
        dropped=estimate.dropped + dropped,
        identifiable=estimate.identifiable + (False,) * len(held),
    )


def _posterior(estimate: Estimate, prior: ElasticPrior) -> ElasticPrior:
    names = [name for name in prior.parameters.names if name in estimate.parameters]
    if len(names) < len(prior.parameters):
        return prior
    return ElasticPrior(estimate.parameters.subset(names), estimate.marginal(names)[1])
