"""Stage 1 (Neubauer et al. 2015, §4.2): stiffness and damping of drives and bearings from frequency responses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.identification.bearing_axes import ResponseBearings, with_fitting_bearings
from flexcal.elasticity.identification.fit import (
    ResponseData,
    ResponseFit,
    final_fit,
    first_fit,
    fit_responses,
    reweighted_fit,
)
from flexcal.elasticity.identification.held_joints import CompliantHeldJoints
from flexcal.elasticity.identification.lack_of_fit import find_misfit, misfit_std
from flexcal.elasticity.identification.nonlinear_drives import with_hardening, with_hysteresis
from flexcal.elasticity.identification.pose_jackknife import jackknife_std
from flexcal.elasticity.identification.profile_std import profile_std_ratio
from flexcal.elasticity.identification.search import MultiStart, Search
from flexcal.elasticity.identification.torque_scale import TorqueScale
from flexcal.elasticity.response_model import (
    SLIP_SHARE,
    CovarianceWeighting,
    Tolerances,
    Weighting,
    check_responses,
    check_sensors,
    held_inertia_name,
)
from flexcal.estimation import Estimate, is_log_identified, solve
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import MASS_AND_COM, RobotModel, spring_names
from flexcal.progress import Progress, silent

_HAUSMAN = 2.58
"""Difference from the efficient estimate, in its standard deviations, that one in a hundred passes by chance."""
UNSLIPPED = float(np.log1p(SLIP_SHARE))
"""Least 1σ of the logarithm of a drive's stiffness where drives slip: one whose spring never slipped in the experiment is that much softer
under load, and nothing in the responses tells it."""

SPRING_VALUES = (".stiffness", ".damping", ".hardening")


@dataclass(frozen=True, eq=False)
class SpringFit:
    """Result of stage 1.

    `estimate` holds springs and nuisances; `springs` their names in the order of the paper's Table 1, stiffness first. Per pose:
    `predicted` (L, n, n) of the fitted model, the reference motion included; `errors` (L, n, n), the complex errors Δ of Eq. (27);
    `misfit` (poses, n, n), mean |error|² over the measured variance: above 1 where the model does not explain an element.
    `bearings` says with which bearing axes the robot was fitted, and why; None for one without bearings. `sensed` (L, S, n) per
    pose is what sensors on the arm are predicted to read. `scale` is the factor of all inertia where the torques may be in another unit.
    """

    estimate: Estimate
    responses: tuple[FrequencyResponse, ...]
    predicted: tuple[np.ndarray, ...]
    errors: tuple[np.ndarray, ...]
    misfit: np.ndarray
    springs: tuple[str, ...]
    bearings: ResponseBearings | None
    sensed: tuple[np.ndarray, ...]
    scale: TorqueScale | None = None

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the recorded sensors on the arm."""
        return tuple(dict.fromkeys(name for response in self.responses for name in response.sensors))

    def sensor_difference(self, name: str) -> float:
        """Median over lines and poses of the relative difference between measured and predicted readings of a sensor."""
        return _median_difference(
            (response.sensor_response[:, [row := response.sensors.index(name)]], predicted[:, [row]])
            for response, predicted in zip(self.responses, self.sensed, strict=True)
            if response.sensor_response is not None and name in response.sensors
        )

    @property
    def motor_difference(self) -> float:
        """Median relative difference of the motors' accelerations."""
        return _median_difference(
            (response.response, predicted)
            for response, predicted in zip(self.responses, self.predicted, strict=True)
        )

    def robot(self, model: RobotModel) -> RobotModel:
        """Model with the fitted springs, and the bearing axes that they belong to."""
        if self.bearings is not None:
            model = model.with_bearings(self.bearings.taken)
        return model.with_estimate(self.estimate)

    def quantity(self, name: str, truth: float | None = None) -> dict[str, float | bool | str | None]:
        """Estimated quantity as in results files."""
        return self.estimate.quantity(name, truth)


def _median_difference(pairs: Iterable[tuple[np.ndarray, np.ndarray]]) -> float:
    """Median relative difference between measured and predicted rows (L, k, n), over lines, rows and pairs."""
    shares = [
        np.linalg.norm(measured - predicted, axis=2) / np.linalg.norm(predicted, axis=2)
        for measured, predicted in pairs
    ]
    return float(np.median(np.concatenate(shares, axis=None)))


def fit_springs(
    model: RobotModel,
    responses: Sequence[FrequencyResponse],
    *,
    rng: np.random.Generator,
    inertias_known: bool = False,
    plan: MultisinePlan | None = None,
    weighting: Weighting | None = None,
    search: Search | None = None,
    tolerances: Tolerances | None = None,
    progress: Progress = silent,
) -> SpringFit:
    """Fit the linearised elastic robot to the measured responses of all poses, with the uncertainty of each spring.

    The cost is Eq. (26) on the log of the ratio Ĝ/G (linear where Ĝ is poorly known), by default weighed with the covariance of the
    measurement. A `search` (default: `MultiStart`) finds the basin; Levenberg-Marquardt with exact derivatives follows. With another
    `weighting` the same fit comes first: it chooses the model and tells the misfit, and its optimum is the start. With the
    `plan`, what the reference motion does is part of the model: the arm's inertia changes along it, friction acts in pulses at its
    reversals, gaps stand open while the torque of their drive passes zero, and drives harden under it where the responses ask for that.
    `tolerances` are what the model leaves out, all of it in the covariance; `Tolerances.none()` for an exact linear plant.
    `inertias_known` fixes link and payload inertias at the model's.

    The covariance of the estimate is the larger, parameter by parameter, of that which follows from the covariance of the measurement (for
    the default weights the posterior) and the sandwich over clusters of neighbouring lines, the first inflated by the reduced χ² where it
    exceeds 1; a badly known stiffness has the width of its profile likelihood. The damping of a spring whose stiffness is not identifiable
    is not either. Bearing axes that robot.yaml does not declare are those that the responses prefer. Raises `FlexcalError` where responses
    do not fit the robot.
    """
    data = ResponseData(
        tuple(responses),
        plan,
        tolerances=Tolerances() if tolerances is None else tolerances,
        inertias_known=inertias_known,
    )
    check_responses(model, responses)
    check_sensors(model, responses)
    model = model.with_brakes(responses[0].joints)
    search = MultiStart() if search is None else search
    x = search.find(model, responses, *data.parameters(model), rng, progress)
    progress("fitting", 0.0)
    first = first_fit(model, data, x)
    harder = with_hardening(model, data, first)
    if harder is not data:
        # linear drives may have led the fit astray; so both where it ended and where it began are starts
        parameters, began = harder.parameters(model)[0], data.parameters(model)[0].with_coordinates(x)
        starts = (first.estimate.values, {item.name: item.value for item in began})
        fits = [first_fit(model, harder, parameters.coordinates(values)) for values in starts]
        data, first = harder, min(fits, key=lambda fit: fit.estimate.reduced_chi2)
    slipping = with_hysteresis(model, data, first)
    if slipping is not data:
        x = slipping.parameters(model)[0].coordinates(first.estimate.values)
        data, first = slipping, first_fit(model, slipping, x)
    progress("fitting", 0.3)

    def completed(robot: RobotModel, begun: ResponseFit) -> tuple[RobotModel, ResponseFit]:
        if begun.residual.model.robot.bearings != robot.bearings:
            return robot, _searched_fit(robot, data, search, rng, progress, near=begun.x)
        candidates = CompliantHeldJoints.of(robot, responses)
        fit = None
        if candidates.is_supported(robot, data, begun):
            robot, fit = _with_held_joints(robot, candidates, data, search, rng, progress)
        return robot, final_fit(robot, data, begun) if fit is None else fit

    model, likelihood, bearings, rival = with_fitting_bearings(model, data, first, completed)
    progress("fitting", 0.8)
    scale = TorqueScale.of(likelihood)

    def judged(own: ResponseFit) -> tuple[ResponseFit, Estimate]:
        efficient = _widened(own, own, data, scale)
        if isinstance(weighting, CovarianceWeighting | None):
            return own, efficient
        robot, weighted = own.residual.model.robot, replace(data, weighting=weighting)
        fit = reweighted_fit(robot, weighted, own)
        return fit, _no_better_known(_widened(fit, own, data, scale), efficient)

    fit, estimate = judged(likelihood)
    if bearings is not None and rival is not None:
        estimate = _averaged(estimate, judged(rival)[1], bearings.share_of_other)
    progress("fitting", 1.0)
    stacked, axes = fit.predicted(), len(responses[0].joints)
    pairs = zip(fit.residual.poses, stacked, strict=True)
    errors = tuple(pose.errors(g)[:, :axes] for pose, g in pairs)
    predicted = tuple(g[:, :axes] for g in stacked)
    misfit = np.array(
        [
            np.mean(np.abs(r.response - g) ** 2 / r.std**2, axis=0)
            for r, g in zip(responses, predicted, strict=True)
        ]
    )
    return SpringFit(
        estimate,
        tuple(responses),
        predicted,
        errors,
        misfit,
        spring_names(model),
        bearings,
        tuple(g[:, axes:] for g in stacked),
        scale,
    )


def _no_better_known(estimate: Estimate, efficient: Estimate) -> Estimate:
    """Estimate by some weights in which nothing is better known than in the `efficient` one, by those of the measurement's covariance.

    No others make a smaller variance (Gauss and Markov), and the difference of both has the difference of their variances (Hausman 1978).
    Where it is larger than by chance, the other weights' cost has another minimum, or is far from its expansion, and the variance is that
    of the efficient estimate and the square of the difference.
    """
    own, least = np.diag(estimate.covariance), np.diag(efficient.covariance)
    squared = (estimate.parameters.coordinates() - efficient.parameters.coordinates()) ** 2
    other = squared > _HAUSMAN**2 * np.maximum(own - least, 0.0)
    lacking = np.maximum(np.where(other, least + squared, least) - own, 0.0)
    covariance = estimate.covariance + np.diag(lacking)
    return _less_known(estimate, covariance, efficient.identifiable)


def _averaged(estimate: Estimate, other: Estimate, share: float) -> Estimate:
    """Estimate with the mean square error about it of a mixture with a `share` of the `other` one (Buckland et al. 1997).

    Parameters that the other lacks are as well known there as here.
    """
    names, others = estimate.parameters.names, other.parameters
    own = [k for k, name in enumerate(names) if name in others]
    theirs = [others.index(names[k]) for k in own]
    moved = np.zeros(len(names))
    moved[own] = others.coordinates()[theirs] - estimate.parameters.coordinates()[own]
    covariance = estimate.covariance.copy()
    covariance[own], covariance[:, own] = 0.0, 0.0
    covariance[np.ix_(own, own)] = other.covariance[np.ix_(theirs, theirs)]
    covariance = (1 - share) * estimate.covariance + share * (covariance + np.outer(moved, moved))
    return _less_known(estimate, covariance, estimate.identifiable)


def _less_known(estimate: Estimate, covariance: np.ndarray, identifiable: tuple[bool, ...]) -> Estimate:
    """Estimate with a larger covariance, in which also what is not `identifiable` is not, nor dampings without their stiffness."""
    sized = is_log_identified(estimate.parameters, covariance)
    flags = zip(estimate.identifiable, identifiable, sized, strict=True)
    known = dict(zip(estimate.parameters.names, map(all, flags), strict=True))
    allowed = tuple(flag and known.get(_stiffness_of(name), True) for name, flag in known.items())
    return replace(estimate, covariance=covariance, identifiable=allowed)


def _stiffness_of(name: str) -> str:
    """Name of the stiffness that belongs to a damping, which is not identifiable without it."""
    return name.replace(".damping", ".stiffness")


def _with_held_joints(
    model: RobotModel,
    candidates: CompliantHeldJoints,
    data: ResponseData,
    search: Search,
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[RobotModel, ResponseFit | None]:
    """Robot with springs at those of the `candidates` that the data require, and its fit; the same robot and None for none."""
    values: dict[str, float] = {}
    while candidates.springs:
        wider = model.with_drive_springs(candidates.springs)
        parameters = data.parameters(wider)[0]
        if values:
            x = parameters.coordinates({name: values[name] for name in parameters.names})
            fit = fit_responses(wider, data, x)
        else:
            fit = _searched_fit(wider, data, search, rng, progress)
        # where drives slip, the others' intervals would be conditional on a choice that such data do not tell
        if data.hysteresis:
            return wider, fit
        least_significant = candidates.least_significant(wider, data, fit)
        if least_significant is None:
            return wider, fit
        candidates = candidates.only([i for i in candidates.springs if i != least_significant])
        values = fit.estimate.values
    return model, None


def _searched_fit(
    model: RobotModel,
    data: ResponseData,
    search: Search,
    rng: np.random.Generator,
    progress: Progress,
    near: np.ndarray | None = None,
) -> ResponseFit:
    """Fit of a robot with braked elastic joints: first with rotors at rest and, if that leaves a misfit, with rotors that move with the
    arm because position loops hold them; the better of both, and of a fit from the coordinates `near` (p,) where there are any.
    """
    parameters, prior = data.parameters(model)
    x = search.find(
        model,
        data.responses,
        parameters,
        prior,
        rng,
        lambda _, share: progress("fitting", 0.3 + 0.2 * share),
    )
    first = first_fit(model, data, x)
    if find_misfit(first, data.responses) is not None:
        rotors = {
            held_inertia_name(e.name): float(model.drives.rotor_inertia[e.index]) for e in model.elastic
        }
        moving = [(item.name, rotors.get(item.name, item.value)) for item in parameters.with_coordinates(x)]
        second = first_fit(model, data, parameters.coordinates(dict(moving)))
        first = min(first, second, key=lambda fit: fit.estimate.reduced_chi2)
    if near is not None:
        first = min(first, first_fit(model, data, near), key=lambda fit: fit.estimate.reduced_chi2)
    return final_fit(model, data, first)


def _widened(
    fit: ResponseFit, likelihood: ResponseFit, data: ResponseData, scale: TorqueScale | None
) -> Estimate:
    """Estimate with the covariance for measurements whose variance is `Tolerances.inflation` times the assumed one.

    That is H (f V + P) H, with H the inverse Hessian of the cost, P the prior's information and V the covariance of the scores of the data
    (J' J for the default weights, for which H is the posterior), times the reduced χ² of the `likelihood` fit, the one by the covariance
    of the measurement, where it exceeds 1. What springs are known worse by after the sandwich, a misfit where there is one, and the
    profile likelihood is error of the springs alone, independent of each other: masses and centres of mass, whose moments are known far
    better than each of them, stay as they are correlated.
    Where these took up a part of the misfit they count as not identifiable. Where the torques may have another
    `scale`, all springs may.
    """
    problem, fitted = fit.problem, fit.estimate
    hessian, known = fitted.covariance, problem.prior_rows()
    scores, information = fit.score_covariance(), known.T @ known
    std = np.sqrt(np.diag(hessian @ (scores + information) @ hessian))
    inflated = data.tolerances.inflation(data.responses) * scores + information
    covariance = hessian @ inflated @ hessian
    judged = likelihood.estimate
    excess = max(1.0, judged.reduced_chi2 if judged.degrees_of_freedom > 0 else 1.0)
    misfit = find_misfit(likelihood, data.responses)
    wider = std
    if problem.groups is not None and len(np.unique(problem.groups)) > len(fitted.parameters) + 1:
        # at the optimum: no offset is above 1
        robust = solve(problem, starts=fit.x[None], covariance="sandwich", tolerance=1.0)
        wider = np.sqrt(np.diag(robust.covariance))
    if misfit is not None:
        wider = np.maximum(wider, misfit_std(fit, misfit))
    if data.hysteresis:
        scatter = jackknife_std(fit)
        wider = np.hypot(np.maximum(std, wider), fit.x - fit.about)
        wider = wider if scatter is None else np.hypot(wider, scatter)
        drives = [name.endswith(".drive.stiffness") for name in fitted.parameters.names]
        wider = np.maximum(wider, np.where(drives, UNSLIPPED, 0.0))
        # a loss by slip that errs alike in all poses is taken for damping
        lost = fit.residual.model.damping_changes(fit.x)
        share = [abs(lost.get(name.removesuffix(".drive.damping"), 0.0)) for name in fitted.parameters.names]
        wider = np.hypot(wider, data.tolerances.hysteresis * np.array(share))
    factor = np.divide(wider, std, out=np.ones_like(std), where=std > 0)
    factor = np.maximum(factor, np.sqrt(excess)) * profile_std_ratio(problem, fitted, std)
    springs = np.array([name.endswith(SPRING_VALUES) for name in fitted.parameters.names])
    alone = np.where(springs, (factor**2 - excess) * np.diag(covariance), 0.0)
    covariance = excess * covariance + np.diag(alone)
    if scale is not None:
        sized = np.array([name.endswith(SPRING_VALUES[:2]) for name in fitted.parameters.names])
        covariance += scale.log_std**2 * np.outer(sized, sized)
    sized = is_log_identified(fitted.parameters, covariance)
    dropped = {entry.name for entry in fitted.dropped}
    small = {
        name: name not in dropped and size for name, size in zip(fitted.parameters.names, sized, strict=True)
    }
    absorbing = misfit is not None and misfit.inertials > 0
    identifiable = tuple(
        flag
        and small.get(_stiffness_of(name), True)
        and not (absorbing and name.rpartition(".")[2] in MASS_AND_COM)
        for name, flag in small.items()
    )
    return replace(
        fitted,
        covariance=covariance,
        identifiable=identifiable,
        chi2=judged.chi2,
        degrees_of_freedom=judged.degrees_of_freedom,
        misfit=misfit,
    )
