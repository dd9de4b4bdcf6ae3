"""Selection of the poses of frequency experiments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency.candidates import FrequencyPoseCandidates
from flexcal.design.frequency.response_jacobian import response_parameters, response_sensitivity
from flexcal.design.frequency.response_noise import COMMON_SENSORS, ResponseSensors
from flexcal.design.frequency.spring_precision import largest_stiffness_std, spring_criterion
from flexcal.design.optimality import exchange, greedy
from flexcal.design.scene import CollisionChecker
from flexcal.errors import FlexcalError
from flexcal.estimation import LOG_STD_LIMIT, Sensitivity
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

SCREEN = 4
"""Stride of the lines evaluated to compare candidates."""
REFINED = (0.3, 0.12)
"""Standard deviation (rad) of the further candidates about the chosen poses, round by round."""
NEIGHBOURS = 8
"""Number of further candidates about each chosen pose in a round, if feasible."""


@dataclass(frozen=True, eq=False)
class FrequencyPoseSelection:
    """`poses` (P, n) rad, numbers `chosen` (P,) of the `candidates` (C, n), of which the first `drawn` are random and the others near the
    chosen ones; `screened` is the sensitivity of all candidates."""

    poses: np.ndarray
    candidates: np.ndarray
    drawn: int
    chosen: np.ndarray
    screened: Sensitivity


def choose_frequency_poses(
    model: RobotModel,
    plan: MultisinePlan,
    count: int,
    candidates: int,
    rng: np.random.Generator,
    sensors: ResponseSensors = COMMON_SENSORS,
    checker: CollisionChecker | None = None,
    progress: Progress = silent,
) -> FrequencyPoseSelection:
    """Choose `count` of the random `candidates` that jointly determine all springs best under the excitation of `plan`, by exchange.

    Then, twice, further candidates are drawn about the chosen poses, and the exchange goes on.

    Raises `FlexcalError` where too few candidates are feasible, or so few poses leave a stiffness unknown, which is named.
    """
    excitable = FrequencyPoseCandidates(CollisionChecker(model) if checker is None else checker, plan)
    parameters = response_parameters(model, plan)
    criterion = spring_criterion(parameters)
    pool = excitable.random(max(candidates, count), rng, progress)
    screened = response_sensitivity(model, pool, plan, parameters, sensors, every=SCREEN, progress=progress)
    drawn, chosen = len(pool), exchange(screened, count, criterion, progress=progress).chosen
    for number, std in enumerate(REFINED):
        progress("refining", number / len(REFINED))
        near = excitable.near(pool[chosen], NEIGHBOURS, std, rng)
        more = response_sensitivity(model, near, plan, parameters, sensors, every=SCREEN)
        pool = np.concatenate([pool, near])
        rows = np.concatenate([screened.jacobian, more.jacobian])
        screened = Sensitivity(rows, parameters, screened.prior_information)
        chosen = exchange(screened, count, criterion, start=chosen).chosen
    progress("refining", 1.0)
    worst, std = largest_stiffness_std(screened, chosen)
    if std > LOG_STD_LIMIT:
        raise FlexcalError(
            "E-DESIGN-009",
            f"{count} poses cannot determine {worst}: its predicted standard deviation is {100 * std:.0f} %; choose more poses, "
            "or hold a payload off the wrist's axis.",
        )
    return FrequencyPoseSelection(pool[chosen], pool, drawn, chosen, screened)


def stiffness_curve(
    chosen: FrequencyPoseSelection, counts: np.ndarray, rng: np.random.Generator, random_sets: int = 10
) -> tuple[np.ndarray, np.ndarray]:
    """Largest predicted standard deviation of a stiffness (K,) for `counts` (K,) of poses: chosen one by one, and at random (median)."""
    screened = chosen.screened
    order = greedy(screened, int(max(counts)), spring_criterion(screened.parameters)).chosen
    random = [
        np.median(
            [
                largest_stiffness_std(screened, rng.choice(chosen.drawn, k, replace=False))[1]
                for _ in range(random_sets)
            ]
        )
        for k in counts
    ]
    return np.array([largest_stiffness_std(screened, order[:k])[1] for k in counts]), np.array(random)
