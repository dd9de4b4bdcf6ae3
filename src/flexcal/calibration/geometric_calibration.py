"""Stage 2: the geometry from measured points, with the elastic deflection taken into account (P1 §3 and §5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.calibration.elastic_prior import NOTHING_ELASTIC, ElasticPrior
from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.flanks import ambiguous_poses, require_both_flanks
from flexcal.calibration.geometry_fit import GeometryFit, LossName
from flexcal.calibration.marginal_fit import marginalised
from flexcal.calibration.measured_points import require_points
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
    Squares,
    analyse,
)
from flexcal.estimation.loss import loss_named
from flexcal.model import RobotModel

_FLANK_PASSES = 4
_SCATTER_PASSES = 5
_STRUCTURAL_POSES = 100

_NORMAL_MEDIAN = 1.4826
"""Standard deviation over median size of a Gaussian."""

_SMALLEST_SCATTER = 1e-9
"""Points without any noise still need a sigma (m)."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A fitted geometry.

    `model` is the calibrated robot; `estimate` holds all geometric parameters (dropped ones at their start, not identifiable) and
    stiffness and inertia as `prior` and points together have them; `identifiability` is that of the kinematic Jacobian; `residuals`
    (N, 3) m, measured minus predicted; `flank` (N, n); `ambiguous` (N,) poses whose flank is not certain; `terms` those fitted.
    """

    model: RobotModel
    estimate: Estimate
    prior: ElasticPrior
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
    terms: Sequence[str] = ("kinematic", "backlash"),
    elastic: bool = True,
    elasticity: Literal["reestimated", "marginalised"] = "reestimated",
    secant_scale: float = 0.0,
    loss: Loss | LossName = "squares",
    progress: Callable[[int, float], None] | None = None,
) -> Calibration:
    """Fit the geometry of `model` to measured points, Levenberg-Marquardt on the vector error (28) with the Jacobian (29).

    Rank and dropped parameters come from the kinematic Jacobian at zero deflection. What the model's posterior holds of stiffness and
    inertia (stage 1) is their prior, so give the model without an earlier calibration on the same poses. It enters by re-estimating those
    parameters, or, marginalised, through the residual covariance R + J Σ Jᵀ; both give the same estimate. `secant_scale` lets each
    drive's stiffness under gravity differ from the tangent one. Without `elastic` the arm is fitted as rigid. `loss` "cauchy" finds
    outliers. Where the poses give no sigma, the scatter about a first fit stands for it (`poses.sigma` of the result).

    Raises `FlexcalError` for measured lengths and orientations, fewer rows than identifiable parameters, poses that are all equal,
    joints that do not move, a backlash seen from one flank only, stations that robot.yaml does not know, and a robust loss with
    marginalised elasticity.
    """

    def estimated(task: GeometryFit) -> Estimate:
        if elasticity == "marginalised" and len(task.prior.parameters):
            return marginalised(task, progress=progress)
        return task.reestimated(loss=loss, progress=progress)

    def fit(measured: PoseSet) -> Calibration:
        prior = ElasticPrior.of(model, measured, secant_scale=secant_scale) if elastic else NOTHING_ELASTIC
        return _fit(model, measured, tuple(terms), prior, elastic, estimated)

    robust = not isinstance(loss_named(loss), Squares)
    if elasticity == "marginalised" and robust:
        raise FlexcalError(
            "a robust loss weighs poses one by one, but marginalised elasticity ties them together; re-estimate it instead."
        )
    require_points(poses)
    _check_variety(model, poses)
    found = fit(poses)
    for _ in range(0 if poses.sigma_given else _SCATTER_PASSES):
        before, poses = poses, _with_scatter(found, robust)
        found = fit(poses)
        if np.allclose(poses.sigma, before.sigma, rtol=0.01, atol=0.0):
            break
    return found


def _fit(
    model: RobotModel,
    poses: PoseSet,
    terms: tuple[str, ...],
    prior: ElasticPrior,
    elastic: bool,
    estimated: Callable[[GeometryFit], Estimate],
) -> Calibration:
    """One fit to poses with a sigma, repeated until the flanks are those of the robot that it finds."""
    start = register(model, poses, predict(_with_identity_stations(model), poses, elastic=elastic).position)
    flank = predict(start, poses, elastic=elastic).rest.flank
    if "backlash" in terms:
        require_both_flanks(model, flank)
    geometric = geometric_parameters(start, poses, terms)
    found = _kinematic_identifiability(start, poses, geometric)
    _require_enough(start, poses, geometric, found)
    kept = geometric.subset(found.kept_names)
    for _ in range(_FLANK_PASSES):
        estimate = estimated(GeometryFit(start, poses, kept, prior, flank, elastic))
        fitted = start.with_values(estimate.values)
        after = predict(fitted, poses, elastic=elastic, jacobians=True)
        if (after.rest.flank == flank).all():
            break
        flank = after.rest.flank
        if "backlash" in terms:
            require_both_flanks(model, flank)
    full = _with_held(estimate, _held(geometric, found.dropped, fitted, poses), found.dropped)
    calibrated = fitted.with_estimate(full)
    return Calibration(
        model=calibrated,
        estimate=full,
        prior=prior,
        identifiability=found,
        poses=poses,
        residuals=poses.position - after.position,
        flank=flank,
        ambiguous=ambiguous_poses(calibrated, after),
        terms=terms,
    )


def _with_scatter(found: Calibration, robust: bool) -> PoseSet:
    """The poses with sigma taken from the scatter about a fit; with a robust loss from its median."""
    rows, freedom = found.residuals.size, max(found.estimate.degrees_of_freedom, 1)
    if not robust:
        scatter = float(np.sqrt(np.sum(found.residuals**2) / freedom))
    else:
        freedom = max(rows - found.identifiability.rank, 1)
        scatter = _NORMAL_MEDIAN * float(np.median(np.abs(found.residuals))) * np.sqrt(rows / freedom)
    return replace(found.poses, sigma=np.full_like(found.poses.sigma, max(scatter, _SMALLEST_SCATTER)))


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
