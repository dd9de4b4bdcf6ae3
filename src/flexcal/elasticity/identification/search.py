"""Global search for the start of the fit, on a cost with a wide basin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.elasticity.response_model import ResponseModel, ResponseResidual, element_scale
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameters, Problem, solve
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel, spring_names
from flexcal.progress import Progress, silent


class Search(Protocol):
    """Global search for coordinates (p,) in the basin of the best fit."""

    def find(
        self,
        robot: RobotModel,
        responses: Sequence[FrequencyResponse],
        parameters: Parameters,
        prior: np.ndarray,
        rng: np.random.Generator,
        progress: Progress = silent,
    ) -> np.ndarray:
        """Initial estimation coordinates (p,) of the fit; `prior` (p, p) is the prior covariance of the parameters."""
        ...


@dataclass(frozen=True)
class TemperedWeighting:
    """Equal weights of all errors, with the standard deviation `sigma`: a cost sensitive to gross differences only."""

    sigma: float = 0.3

    def factor(self, response: FrequencyResponse, covariance: np.ndarray) -> np.ndarray:
        """The factor of `Weighting`."""
        return np.broadcast_to(np.eye(covariance.shape[-1]) / self.sigma, covariance.shape)


@dataclass(frozen=True)
class MultiStart:
    """Levenberg–Marquardt with exact derivatives from many starts, the default.

    The first start is robot.yaml's; the others have every spring multiplied by e^u, u uniform within ± log `factor`. About `lines`
    lines a pose are used, errors count as in `TemperedWeighting`, so that priors keep the nuisances in place and the search does
    not chase noise. It ends when `agreement` starts have reached the lowest cost, or after `starts`.
    """

    starts: int = 12
    factor: float = 3.0
    agreement: int = 3
    lines: int = 26
    sigma: float = 0.3

    def find(
        self,
        robot: RobotModel,
        responses: Sequence[FrequencyResponse],
        parameters: Parameters,
        prior: np.ndarray,
        rng: np.random.Generator,
        progress: Progress = silent,
    ) -> np.ndarray:
        """The best end point; see the class."""
        thinned = thin(responses, self.lines)
        residual = ResponseResidual.of(
            ResponseModel.of(robot, thinned, parameters), thinned, TemperedWeighting(self.sigma)
        )
        problem = Problem(parameters, residual.linearise, residual.residual, prior)
        springs = [parameters.index(name) for name in spring_names(robot)]
        ends: list[tuple[float, np.ndarray]] = []
        progress("searching", 0.0)
        for number in range(self.starts):
            x = parameters.coordinates()
            if number:
                x[springs] += rng.uniform(-1.0, 1.0, len(springs)) * np.log(self.factor)
            try:
                end = solve(problem, starts=x[None], max_iterations=60, tolerance=1e-2)
            except FlexcalError:
                continue
            ends.append((end.cost, end.parameters.coordinates()))
            lowest = min(cost for cost, _ in ends)
            progress("searching", (number + 1) / self.starts)
            if sum(cost < 1.02 * lowest + 0.5 for cost, _ in ends) >= self.agreement:
                break
        if not ends:
            raise FlexcalError(
                "E-STIFF-001",
                "The elastic robot could not be evaluated at any start; check the stiffnesses in robot.yaml.",
            )
        progress("searching", 1.0)
        return min(ends, key=lambda end: end[0])[1]


@dataclass(frozen=True)
class PopulationSearch:
    """Differential evolution (Storn and Price 1997) over the springs alone, in place of the paper's genetic algorithm.

    Springs range over ×÷`factor` about robot.yaml, everything else stays at its start. The cost is the mean of
    |Ĝ - G|² / (|Ĝ_ii Ĝ_jj| + |G|²), smooth and bounded: no phase wraps in it.
    """

    factor: float = 3.0
    population: int = 90
    generations: int = 150
    lines: int = 26

    def find(
        self,
        robot: RobotModel,
        responses: Sequence[FrequencyResponse],
        parameters: Parameters,
        prior: np.ndarray,
        rng: np.random.Generator,
        progress: Progress = silent,
    ) -> np.ndarray:
        """The best individual of the last generation; see the class."""
        from scipy.optimize import differential_evolution

        thinned = thin(responses, self.lines)
        model = ResponseModel.of(robot, thinned, parameters)
        springs = [parameters.index(name) for name in spring_names(robot)]
        start = parameters.coordinates()
        scales = [element_scale(response.stacked) for response in thinned]
        done = 0
        progress("searching", 0.0)

        def cost(u: np.ndarray) -> float:
            x = start.copy()
            x[springs] += u
            try:
                predicted = model.responses(x)
            except FlexcalError:
                return 2.0
            pairs = zip(thinned, predicted, scales, strict=True)
            return float(np.mean([relative_difference(r.stacked, g, scale).mean() for r, g, scale in pairs]))

        def tell(_: np.ndarray, convergence: float = 0.0) -> None:
            nonlocal done
            done += 1
            progress("searching", done / self.generations)

        evolution = differential_evolution(
            cost,
            [(-np.log(self.factor), np.log(self.factor))] * len(springs),
            popsize=max(1, self.population // len(springs)),
            maxiter=self.generations,
            tol=1e-4,
            polish=False,
            rng=rng,
            callback=tell,
        )
        progress("searching", 1.0)
        start[springs] += evolution.x
        return start


def relative_difference(measured: np.ndarray, predicted: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """|Ĝ - G|² / (scale² + |G|²), elementwise: about |log(Ĝ/G)|²/2 near the fit, between 0 and 2 everywhere."""
    return np.abs(measured - predicted) ** 2 / (scale**2 + np.abs(predicted) ** 2)


def thin(responses: Sequence[FrequencyResponse], lines: int) -> list[FrequencyResponse]:
    """Responses restricted to about `lines` evenly spaced lines each."""
    result = []
    for response in responses:
        step = max(1, round(len(response.frequencies_hz) / lines))
        result.append(response.at_lines(slice(None, None, step)))
    return result
