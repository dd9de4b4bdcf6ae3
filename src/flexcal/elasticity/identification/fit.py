"""Weighted fit of the linearised elastic robot to the frequency responses of all poses (Eqs. 26, 27)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.response_model import (
    CLUSTER_LINES,
    CovarianceWeighting,
    ExperimentEffect,
    ModelError,
    ResponseModel,
    ResponseResidual,
    Tolerances,
    Weighting,
    experiment_effects,
    stiffness_parameters,
)
from flexcal.elasticity.time_periodic import ReferenceMotion
from flexcal.estimation import Estimate, Parameters, Problem, solve
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

ROUNDS = 2
"""Number of fits, each with model error and reference motion evaluated at the last optimum."""

MEANS = 2
"""Number of further fits where drives slip, each followed by the mean of its optimum and where it was evaluated."""

FINE, COARSE = 1e-6, 1e-3
"""Tolerances of the last fit, and of the preceding ones."""
SLIPPING = 1e-4
"""Tolerance of the last fit where drives slip, a hundredth of a standard deviation: another evaluation moves the optimum farther."""
COARSE_ITERATIONS = 60
"""Largest number of iterations of the preceding fits: with a wrong model they may continue for hundreds without result."""


@dataclass(frozen=True, eq=False)
class ResponseData:
    """Measured responses, with the conditions of measurement and their weights.

    With the `plan`, the reference motion is part of the prediction. `tolerances` are the standard deviations of what the model leaves out.
    `inertias_known` keeps link and payload inertias at the model's; with `hardening` and `hysteresis` those of the drives are estimated.
    """

    responses: tuple[FrequencyResponse, ...]
    plan: MultisinePlan | None = None
    weighting: Weighting = field(default_factory=CovarianceWeighting)
    tolerances: Tolerances = field(default_factory=Tolerances)
    inertias_known: bool = False
    hardening: bool = False
    hysteresis: bool = False

    @property
    def effects(self) -> bool:
        """Whether the fit depends on terms evaluated at its start: model error, or effects of the experiment."""
        return self.tolerances.any or self.plan is not None

    def parameters(self, model: RobotModel) -> tuple[Parameters, np.ndarray]:
        """Parameters of stage 1 and their joint prior covariance (p, p); raises `FlexcalError` for responses of another robot."""
        return model.posterior.prior(
            stiffness_parameters(
                model,
                self.responses,
                inertias_known=self.inertias_known,
                backlash=self.plan is not None,
                hardening=self.hardening,
                hysteresis=self.hysteresis,
            )
        )


@dataclass(frozen=True, eq=False)
class ResponseFit:
    """Result of a fit of one robot: `estimate` with the posterior covariance of `problem`.

    `effects` are those of the experiment in every pose, added to what `residual.model` predicts at rest; `error` what the model leaves out;
    both were evaluated at the coordinates `about` (p,).
    """

    about: np.ndarray
    residual: ResponseResidual
    effects: tuple[ExperimentEffect, ...]
    error: ModelError | None
    problem: Problem
    estimate: Estimate

    @property
    def x(self) -> np.ndarray:
        """Estimation coordinates (p,) of the optimum."""
        return self.estimate.parameters.coordinates()

    @property
    def log_prior(self) -> float:
        """Logarithm of the likelihood's factors beside exp(-rᵀr / 2), up to a constant: covariance of the model error, and prior."""
        offset = self.problem.prior_rows() @ (self.x - self.problem.parameters.prior_mean())
        return -0.5 * float(offset @ offset + (0.0 if self.error is None else self.error.log_determinant))

    def whiten(self, rows: np.ndarray) -> np.ndarray:
        """Rows (m,) or (m, c), whitened by the measurement's covariance, after whitening by the model error as well."""
        return rows if self.error is None else self.error.whiten(rows)

    def score_covariance(self) -> np.ndarray:
        """Covariance (p, p) of Jᵀ r by that of responses and model error: Jᵀ J where the weights are their inverse.

        With S the whitening (1 + B Bᵀ)^(-1/2) by the model error B and N Nᵀ the covariance of the weighted errors, that of r is
        S (N Nᵀ + B Bᵀ) Sᵀ = 1 - S Sᵀ + S N Nᵀ Sᵀ.
        """
        jacobian = self.problem.linearise(self.x)[1]
        through = jacobian if self.error is None else self.error.transposed(jacobian)
        scatter = self.residual.by_noise(through)
        return jacobian.T @ jacobian - through.T @ through + scatter.T @ scatter

    def predicted(self) -> tuple[np.ndarray, ...]:
        """Responses (L, E + S, E) of every pose at the optimum, effects of the experiment included."""
        responses = self.residual.model.responses(self.x)
        return tuple(g + effect.shift for g, effect in zip(responses, self.effects, strict=True))


def fit_responses(
    model: RobotModel, data: ResponseData, x: np.ndarray, progress: Progress = silent
) -> ResponseFit:
    """Fit from the coordinates `x` (p,), repeated with model error and experiment effects evaluated at the optimum."""
    progress("fitting", 0.0)
    first = first_fit(model, data, x)
    progress("fitting", 1 / (ROUNDS + 1))
    return final_fit(model, data, first)


def first_fit(model: RobotModel, data: ResponseData, x: np.ndarray) -> ResponseFit:
    """Fit from the coordinates `x` (p,), at which model error and experiment effects are evaluated."""
    return _fit(model, data, x, COARSE if data.effects else FINE)


def final_fit(model: RobotModel, data: ResponseData, first: ResponseFit) -> ResponseFit:
    """Fit from the optimum of `first`, at which model error and experiment effects are evaluated, if there are any.

    Where drives slip, the optimum of one evaluation is no fixed point of the next, but lies beyond it: the means of both are.
    """
    if not data.effects:
        return first
    if not data.hysteresis:
        return _fit(model, data, first.x, FINE)
    x = first.x
    for _ in range(MEANS):
        x = (x + _fit(model, data, x, COARSE).x) / 2
    return _fit(model, data, x, SLIPPING)


def reweighted_fit(model: RobotModel, data: ResponseData, first: ResponseFit) -> ResponseFit:
    """Fit by the weights of `data` from the optimum of `first`, which has others, and with its model error and experiment effects."""
    return _fit(model, data, first.x, FINE)


def _fit(model: RobotModel, data: ResponseData, x: np.ndarray, tolerance: float) -> ResponseFit:
    """Levenberg–Marquardt from `x` (p,), at which model error and experiment effects are evaluated."""
    parameters, prior = data.parameters(model)
    plan, responses = data.plan, data.responses
    predicting = ResponseModel.of(model, responses, parameters)
    effects = [ExperimentEffect.none(response) for response in responses]
    if plan is not None:
        predicting = predicting.with_loaded_drives(x, plan)
        if plan.reference_amplitude > 0:
            effects = experiment_effects(predicting, x, ReferenceMotion.of(plan))
    residual = ResponseResidual.of(predicting, responses, data.weighting)
    residual = residual.shifted(predicting, [effect.shift for effect in effects])
    tolerances = replace(data.tolerances, inertia=data.tolerances.inertia and not data.inertias_known)
    error = ModelError.of(residual, responses, x, effects, tolerances) if tolerances.any else None
    problem = _problem(residual, error, parameters, prior)
    iterations = COARSE_ITERATIONS if tolerance == COARSE else 200
    fitted = solve(problem, starts=x[None], tolerance=tolerance, max_iterations=iterations)
    return ResponseFit(x, residual, tuple(effects), error, problem, fitted)


def _problem(
    residual: ResponseResidual, error: ModelError | None, parameters: Parameters, prior: np.ndarray
) -> Problem:
    def whiten(rows: np.ndarray) -> np.ndarray:
        return rows if error is None else error.whiten(rows)

    def linearise(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows, jacobian = residual.linearise(at)
        return whiten(rows), whiten(jacobian)

    return Problem(
        parameters,
        linearise,
        lambda at: whiten(residual.residual(at)),
        prior_covariance=prior,
        groups=residual.clusters(CLUSTER_LINES),
    )
