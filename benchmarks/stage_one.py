"""Stage 1, 18 parameters in 3 poses on all lines: multi-start with exact derivatives against SciPy's differential evolution.

Both minimise the cost of Eqs. (26), (27) on the same data with everything but the springs known, from ×÷3 about the nominal robot. The
peer evaluates Eq. (9) (with the arm, as flexcal does) by NumPy, all lines of a pose at once.
"""

from __future__ import annotations

import contextlib
import csv
import sys
import time
from pathlib import Path

import numpy as np

from flexcal.elasticity.identification import MultiStart
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResponseModel,
    ResponseResidual,
    stiffness_parameters,
)
from flexcal.estimation import Problem, solve
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel, spring_names
from flexcal.model.vibration import linearise

EXAMPLE = Path(__file__).parent.parent / "examples" / "tx90l"
PEER_SECONDS = 200.0
NOISE = 0.02


def run() -> list[tuple[str, float, str]]:
    """(name, ratio of the peer's time to ours, note)."""
    rng = np.random.default_rng(1)
    robot = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    names = spring_names(robot)
    truth = robot.with_values({n: robot.value(n) * np.exp(0.3 * rng.standard_normal()) for n in names})
    responses = [_measured(truth, q, rng) for q in _poses()[:3]]

    start = time.perf_counter()
    parameters = stiffness_parameters(robot, responses, inertias_known=True).subset(names)
    found = MultiStart().find(robot, responses, parameters, np.diag(parameters.prior_std() ** 2), rng)
    residual = ResponseResidual.of(
        ResponseModel.of(robot, responses, parameters), responses, CovarianceWeighting()
    )
    fit = solve(
        Problem(parameters, residual.linearise, residual.residual), starts=found[None], tolerance=1e-6
    )
    ours = time.perf_counter() - start

    peer, reached, evaluations = _peer(robot, names, responses, 1.01 * fit.chi2)
    note = f"{ours:.2f} s against {peer:.0f} s and {evaluations} evaluations"
    if reached > 1.01 * fit.chi2:
        note += f"; a lower bound: the peer was stopped at {reached / fit.chi2:.3g} times our cost"
    return [("stage 1, 18 parameters, 3 poses, global search included", peer / ours, note)]


def _poses() -> np.ndarray:
    with (EXAMPLE / "frequency_poses.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["plan"] == "default"]
    return np.deg2rad([[float(row[f"q{i}_deg"]) for i in range(1, 7)] for row in rows])


def _response(robot: RobotModel, q: np.ndarray, frequencies_hz: np.ndarray) -> np.ndarray:
    system = linearise(robot, q)
    s = 2j * np.pi * frequencies_hz[:, None, None]
    inverse = np.linalg.inv(s**2 * system.mass + s * system.damping + system.stiffness)
    return s**2 * inverse[:, : system.inputs, : system.inputs]


def _measured(truth: RobotModel, q: np.ndarray, rng: np.random.Generator) -> FrequencyResponse:
    frequencies = np.arange(13, 320, 2) * 0.25
    response = _response(truth, q, frequencies)
    one = NOISE**2 * response @ np.swapaxes(response, 1, 2).conj()
    covariance = np.zeros((len(frequencies), 9, 9), dtype=complex)
    for c in range(3):
        covariance[:, 3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = one
    draw = rng.standard_normal((2, *response.shape)) / np.sqrt(2)
    response = response + NOISE * response @ (draw[0] + 1j * draw[1])
    joints = truth.joint_names[:3]
    return FrequencyResponse(
        frequencies, response, covariance, covariance, 45.0, response[None], joints, q, None, 0, 1 / 4000
    )


class _Enough(Exception):
    """The peer has reached the cost, or its time is over."""


def _peer(
    robot: RobotModel, names: tuple[str, ...], responses: list[FrequencyResponse], target: float
) -> tuple[float, float, int]:
    from scipy.optimize import differential_evolution

    whitening = [CovarianceWeighting().factor(r, r.log_covariance()) for r in responses]
    nominal = np.array([robot.value(name) for name in names])
    start, best, evaluations = time.perf_counter(), np.inf, 0

    def cost(u: np.ndarray) -> float:
        nonlocal best, evaluations
        trial = robot.with_values(dict(zip(names, nominal * np.exp(u), strict=True)))
        total = 0.0
        for response, factor in zip(responses, whitening, strict=True):
            error = np.log(response.response / _response(trial, response.q_mean, response.frequencies_hz))
            vector = np.swapaxes(error, 1, 2).reshape(len(error), -1, 1)
            total += 2 * float(np.sum(np.abs(factor @ vector) ** 2))
        evaluations += 1
        best = min(best, total)
        if best <= target or time.perf_counter() - start > PEER_SECONDS:
            raise _Enough
        return total

    bounds = [(-np.log(3.0), np.log(3.0))] * len(names)
    with contextlib.suppress(_Enough):
        differential_evolution(
            cost, bounds, maxiter=100000, tol=0, polish=False, rng=np.random.default_rng(0)
        )
    return time.perf_counter() - start, best, evaluations


if __name__ == "__main__":
    for name, ratio, note in run():
        sys.stdout.write(f"{name}: {ratio:.0f} x ({note})\n")
