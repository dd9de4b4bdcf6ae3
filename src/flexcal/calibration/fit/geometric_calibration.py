"""Stage 2: geometry from measured points, with the elastic deflection taken into account (Neubauer et al. 2015, §3 and §5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.calibration.error_model import ErrorComponents, ErrorStatistics, LinearFit
from flexcal.calibration.fit.elastic_prior import NOTHING_ELASTIC, ElasticPrior
from flexcal.calibration.fit.fitted_points import FittedPoints
from flexcal.calibration.fit.fleet_prior import FleetPrior
from flexcal.calibration.fit.least_squares_problem import LossName, PlainLoss
from flexcal.calibration.fit.point_fit import CONVERGED, PointFit
from flexcal.calibration.fit.practical_identifiability import Undetermined
from flexcal.calibration.fit.temperature_evidence import TemperatureEvidence
from flexcal.calibration.fit.terms import moving_joints
from flexcal.calibration.measurement import METRES, ambiguous_poses, kind_names, stated_sigma
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, Identifiability, Loss, Squares, loss_named
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.units import MILLIMETRE

_PASSES = 8
_ROUGH, _NEAR = 0.1, 1e-3
"""Relative offsets at which a fit is close enough to estimate its errors: at first, where directions are free that noise hides and that
take many steps; and once these are held (Bates and Watts 1981).
"""
_NOISE = 1e-3
"""Scatter of a coordinate, m, from which errors may be those of a fit that is still far from its solution."""
_SETTLED = 2e-3
"""Relative change of every standard deviation of the errors at which the components have converged."""


@dataclass(frozen=True, eq=False)
class GeometricFit:
    """Result of the geometric fit.

    `model` is the calibrated robot; `estimate` holds all geometric parameters (dropped and undetermined ones at their start, not
    identifiable), stiffness and inertia as `prior` and points together have them, and the `scatter`; `identifiability` is that of
    the kinematic Jacobian, `undetermined` what has full rank and is hidden by noise or the choice of poses, `by_prior` what has
    a prior that tells more of it than the points; `readings` (R, 3),
    measured minus predicted, m of the points, then rad of the orientations; `linear` the fit linearised at its solution, without outliers;
    `flank` (N, n); `ambiguous` (N,) poses whose flank is not certain; `terms` those fitted;
    `size` the length that is held where no reading tells how large the robot is; `fleet` the prior from other robots of the model, of the
    parameters of this fit; `temperature` what is known of its thermal terms, if any.
    """

    model: RobotModel
    estimate: Estimate
    prior: ElasticPrior
    identifiability: Identifiability
    undetermined: tuple[Undetermined, ...]
    scatter: ErrorComponents
    poses: PoseSet
    readings: np.ndarray
    linear: LinearFit
    flank: np.ndarray
    ambiguous: np.ndarray
    terms: tuple[str, ...]
    size: tuple[str, ...] = ()
    by_prior: tuple[Undetermined, ...] = ()
    fleet: FleetPrior | None = None
    temperature: TemperatureEvidence | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.model.name}: {self.errors}>"

    def summary(self) -> str:
        """Errors at the poses of the fit and every identified parameter with its standard deviation, as text."""
        rows = [
            f"{item.name:<40} {self.estimate.values[item.name]:>12.5g} {spread:<12} {item.unit}"
            for item in self.estimate.parameters
            if (spread := self.estimate.spread(item.name))
        ]
        return "\n".join(
            [
                f"errors of the fit: {self.errors}",
                f"terms: {', '.join(self.terms)}",
                *rows,
                self.estimate.message,
            ]
        )

    @property
    def residuals(self) -> np.ndarray:
        """Measured minus predicted points (N, 3), m."""
        return self.readings[: len(self.poses)]

    @property
    def rotations(self) -> np.ndarray:
        """Rotation vectors (K, 3), rad, from predicted to measured orientations, in the order of the poses that have one."""
        return self.readings[len(self.poses) :][self.poses.turned[self.poses.angled]]

    @property
    def tilts(self) -> np.ndarray:
        """Measured minus predicted readings (K, 3), rad, of inclinometers, in the order of their poses; NaN for axes that they lack."""
        poses, left = self.poses, self.readings[len(self.poses) :]
        if poses.tilt is None:
            return np.zeros((0, 3))
        there = np.isfinite(poses.tilt[poses.tilted])
        return np.where(there, left[poses.tilted[poses.angled]], np.nan)

    @property
    def errors(self) -> ErrorStatistics:
        """Errors of the calibrated robot at the points of the fit."""
        return ErrorStatistics.of(self.residuals[~self.poses.tilted])

    @property
    def errors_by_kind(self) -> dict[str, ErrorStatistics]:
        """Differences, m, from what was measured by each of several kinds of measurements; empty for one kind beside inclinometers."""
        kinds, residuals = kind_names(self.poses.pointed), self.residuals[~self.poses.tilted]
        names = list(dict.fromkeys(kinds.tolist()))
        return {n: ErrorStatistics.of(residuals[kinds == n]) for n in names} if len(names) > 1 else {}

    @property
    def robot_scatter(self) -> float:
        """Scatter of the robot at the measured points, 1σ of a coordinate in m, the repeatability of the joints included."""
        return self.scatter.evenly(self.linear.turns[self.linear.readings.unit == METRES])

    @property
    def variances(self) -> dict[str, float | None]:
        """Uncertainty budget of a measured point, 1σ of a coordinate in mm, as in results.json.

        `instrument_mm` is null where no sigma is stated: the robot's part then holds it. `robot_mm` has the repeatability of the
        joints at the measured points in it. `stated_mm` is the sigma of the files, root mean square. Where several kinds of
        measurements are fitted together, `robot_mm` is of the first, and `views_mm`, `sockets_mm`, `lengths_mm` and `contacts_mm` are
        what the others scatter by for themselves.
        """
        scatter = self.scatter
        if not (self.linear.readings.unit == METRES).any():
            return dict.fromkeys(("instrument_mm", "robot_mm", "model_mm", "stated_mm"))
        sigma = stated_sigma(self.linear.readings)
        stated = self.poses.sigma_given
        return {
            "instrument_mm": scatter.share * sigma / MILLIMETRE if stated else None,
            "robot_mm": self.robot_scatter / MILLIMETRE,
            "model_mm": scatter.model / MILLIMETRE,
            "stated_mm": sigma / MILLIMETRE if stated else None,
            **{f"{n}_mm": getattr(scatter, n) / MILLIMETRE for n in self.linear.readings.instruments},
        }


def fit_geometry(
    model: RobotModel,
    poses: PoseSet,
    *,
    terms: Sequence[str] = ("kinematic", "backlash", "transmission"),
    elastic: bool = True,
    elasticity: Literal["reestimated", "marginalised"] = "reestimated",
    secant_scale: float = 0.0,
    loss: Loss | LossName = "auto",
    fleet: FleetPrior | None = None,
    kinds: Mapping[str, str] | None = None,
    near: Mapping[str, float] | None = None,
    frame: GeometricFit | None = None,
    tolerance: float = CONVERGED,
    progress: Progress = silent,
) -> GeometricFit:
    """Fit the geometry of a robot to measured points by the Levenberg-Marquardt method (vector error (28), Jacobian (29)).

    `calibrate` calls it with the terms that it selects. Rank and dropped parameters come from the kinematic Jacobian at zero
    deflection. Points are weighted by the sum of three variances, those of instrument, robot and model error, which restricted
    maximum likelihood estimates from the points; a stated sigma is that of the instrument alone.

    Parameters
    ----------
    model : RobotModel
        Robot without an earlier calibration on the same poses. What its posterior holds of stiffness and inertia (stage 1) is
        their prior.
    poses : PoseSet
        Joint positions (N, n) in rad or m and measured points (N, 3) in m, with orientations where they were
        measured.
    terms : sequence of str
        Names of the error terms. `transmission`, transmission errors of all revolute joints as waves in the joint position, is
        a random effect: all waves are normal with one variance, which falls with the square of their order and is estimated
        with those of the scatter (best linear unbiased prediction). Few poses leave them near zero and uncertain.
        `transmission_1`… are free waves of one order; `ratio` are leads of slides and ratios by which joints follow others; `thermal`,
        `thermal_links`, `thermal_drift` and `thermal_stations` are changes with the measured temperature.
    elastic : bool
        Whether the arm deflects; without, it is fitted as rigid.
    elasticity : {"reestimated", "marginalised"}
        How the uncertainty of stiffness and inertia enters: by estimating those parameters again, or through the residual
        covariance R + J Σ Jᵀ; both give the same estimate.
    secant_scale : float
        Relative standard deviation of the ratio of each drive's secant stiffness under gravity to its tangent stiffness.
    loss : {"auto", "squares", "huber", "cauchy"} or Loss
        Loss function; "cauchy" finds outliers, "auto" takes it where squares leave some.
    fleet : FleetPrior, optional
        Prior of the geometry from other robots of the model.
    kinds : mapping of str, optional
        Kinds of the parameters whose tolerances in `model` have a factor in common that was estimated from these poses, by name: its
        uncertainty is then part of the covariance (Kass and Steffey 1989).
    near : mapping of float, optional
        Values of parameters from which to start, as of a fit to nearly the same points; by default those of the `model`.
    frame : GeometricFit, optional
        Fit to nearly the same points whose choices are to hold: where the instruments stand, of which the points may determine the place
        only together with the first joint's errors, and which of the parameters that are not separately identifiable are kept. Estimates
        of both fits are then in one frame; by default the instruments are registered anew.
    tolerance : float
        Relative offset at which the fit has converged (Bates and Watts 1981, who suggest 1e-3).
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    GeometricFit
        `model`, `estimate`, `residuals` (N, 3), m, `errors` and `summary()`.

    Raises
    ------
    FlexcalError
        For fewer rows than identifiable parameters, poses that are all equal, joints that
        do not move, a backlash seen from one flank only, stations that robot.yaml does not know, and a robust loss with
        marginalised elasticity.

    Examples
    --------
    >>> from flexcal import RobotModel, fit_geometry, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> fit = fit_geometry(model, poses, terms=("kinematic",))
    >>> print(f"{fit.errors.mean * 1e3:.1f} mm")
    0.1 mm
    """
    robust = loss != "auto" and not isinstance(loss_named(loss), Squares)
    if elasticity == "marginalised" and robust:
        raise FlexcalError(
            "E-CAL-005",
            "a robust loss weights poses individually, but marginalised elasticity correlates them; use re-estimated elasticity instead.",
        )
    _check_variety(model, poses)
    prior = ElasticPrior.of(model, poses, secant_scale=secant_scale) if elastic else NOTHING_ELASTIC
    fit = PointFit.of(
        model,
        poses,
        tuple(terms),
        prior,
        elastic,
        marginalised=elasticity == "marginalised",
        near=near or {},
        placed=None if frame is None else frame.model,
        kept=() if frame is None else frame.identifiability.kept_names,
        progress=progress,
        fleet=fleet,
        kinds=kinds,
    )
    choose = loss == "auto" and elasticity == "reestimated"
    if choose and fit.has_wrong_readings:
        # of points that are metres off the squares would be least where the arm is folded over
        found = _polished(_settled(_rough(fit, "huber"), "cauchy"), "cauchy", tolerance)
        if found.estimate.outliers:
            return _calibration(found)
    first, plain = _rough(fit, "squares"), "squares" if loss == "auto" else loss
    fitted = _settled(first, plain)
    if choose and fitted.suspects_outliers:
        again = _polished(_settled(first, "cauchy"), "cauchy", tolerance)
        if again.estimate.outliers:
            return _calibration(again)
    return _calibration(_polished(fitted, plain, tolerance))


def _rough(fit: PointFit, loss: PlainLoss) -> FittedPoints:
    """Fit that is close enough to estimate its errors, or has converged where these are no noise."""
    fitted = fit.solved(fit.first_scatter, loss, tolerance=_ROUGH)
    if fitted.robust_scatter().robot < _NOISE:
        return fitted
    return fit.solved(fit.first_scatter, loss, fitted)


def _settled(fitted: FittedPoints, loss: Loss | PlainLoss) -> FittedPoints:
    """Fit with the scatter of its own residuals, with the parameters undetermined under that scatter held, from a rough one.

    With a robust loss a point may be an outlier under one scatter and none under the next, and so on: a scatter that comes again ends it.
    """
    fit, seen = fitted.fit, []
    if not isinstance(loss_named(loss), Squares):
        for _ in range(_PASSES):
            before, fitted = fitted, fit.solved(fitted.robust_scatter(), loss, fitted, tolerance=_ROUGH)
            if not fitted.estimate.iterations or fitted.scatter.settled(before.scatter, 1e-2):
                break
    for _ in range(_PASSES):
        scatter, spread = fitted.estimated_scatter()
        fixed = fitted.undetermined(scatter)
        seen.append(fitted.scatter)
        if fixed == fitted.fixed and any(scatter.settled(before, _SETTLED) for before in seen):
            break
        before = fitted
        fitted = fit.solved(scatter, loss, fitted, fixed=fixed, spread=spread, tolerance=_NEAR)
        if not fitted.estimate.iterations and fitted.has_residuals_of(before):
            break
    return fitted


def _polished(fitted: FittedPoints, loss: Loss | PlainLoss, tolerance: float) -> FittedPoints:
    """Fit that has converged, under the same scatter."""
    return fitted.fit.solved(
        fitted.scatter, loss, fitted, fixed=fitted.fixed, spread=fitted.spread, tolerance=tolerance
    )


def _calibration(fitted: FittedPoints) -> GeometricFit:
    fit = fitted.fit
    estimate = fitted.whole_estimate()
    calibrated = fitted.model.with_estimate(estimate)
    return GeometricFit(
        model=calibrated,
        estimate=estimate,
        prior=fitted.task.prior,
        identifiability=fit.identifiability,
        undetermined=fitted.fixed,
        by_prior=fitted.told_by_prior(),
        scatter=fitted.scatter,
        poses=fitted.poses,
        readings=fitted.at.residual,
        linear=fitted.linear,
        flank=fitted.flank,
        ambiguous=ambiguous_poses(calibrated, fitted.at),
        terms=fit.terms,
        size=fit.size,
        fleet=fit.fleet,
        temperature=None if fitted.temperature is None else fitted.temperature[1],
    )


def _check_variety(model: RobotModel, poses: PoseSet) -> None:
    if len(poses.q) < 2:
        raise FlexcalError("E-CAL-006", f"there are {len(poses.q)} poses; a calibration needs many.")
    spread = np.ptp(poses.q, axis=0)
    if spread.max() < 1e-6:
        raise FlexcalError(
            "E-CAL-007", f"all {len(poses.q)} poses are the same; measure poses that differ in every joint."
        )
    pointing = moving_joints(model, poses.pointed)
    still = [
        model.joints[i].name
        for i, range_ in zip(model.motors, spread, strict=True)
        if i in pointing and range_ < 1e-6
    ]
    if still:
        raise FlexcalError(
            "E-CAL-008",
            f"{', '.join(still)} never moves in the {len(poses.q)} poses; move every joint, or its errors are not identifiable.",
        )
