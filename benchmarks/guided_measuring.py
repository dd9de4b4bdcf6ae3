"""Guided measuring against random poses on the virtual TX90L: how many poses until the calibrated robot is as accurate; 10 robots, minutes.

Desired is the error that is predicted after 35 random poses, the median of three plans. A guided session measures the pose that it names
best until that is predicted. Counted are the random poses after which it is, and those after which the true error is that of the guided
session at its end: the 90 % quantile against noise-free points at 200 fresh poses over the workspace.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core below

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks._tasks import in_parallel
from flexcal import PosePlan, RobotModel, VirtualCell
from flexcal.design.poses import random_candidates
from flexcal.design.scene import CollisionChecker
from flexcal.jobs.guidance import DEFAULT_CHOICE, GuidedSession, PoseChoice
from flexcal.virtual_cell import CellConfig

ROBOT = Path(__file__).parents[1] / "examples" / "tx90l" / "robot.yaml"
ROBOTS, MOST, PLANS, DESIRED = 10, 60, 3, 35
COUNTS = np.arange(21, MOST, 2)


def one_robot(seed: int) -> tuple[int, float, float, float, int]:
    """Guided poses, random poses until as much is predicted and until the true error is as small, predicted over true error, wrong rows."""
    model = RobotModel.from_yaml(ROBOT, estimates=False)
    choice, checker = GuidedSession(model).candidates, CollisionChecker(model)
    cell = VirtualCell.drawn(model, CellConfig(), seed)[0]
    fresh = PosePlan(q=random_candidates(checker, 200, np.random.default_rng(1000 + seed)))
    truth = cell.noise_free(fresh)
    predicted, true, wrong = [], [], 0
    for number in range(PLANS):
        rng = np.random.default_rng([seed, number])
        plan = PosePlan(q=random_candidates(checker, MOST, rng, preload=True), seed=10_000 + number)
        measured = cell.measure(plan)
        sessions = [
            GuidedSession(model, rows=measured.subset(slice(0, int(count))), choice=choice)
            for count in COUNTS
        ]
        predicted.append([session.prospect().p90 for session in sessions])
        true.append([_p90(session, choice, fresh, truth) for session in sessions])
    desired = float(np.median(np.array(predicted)[:, np.searchsorted(COUNTS, DESIRED)]))
    session = GuidedSession(model, request=replace(DEFAULT_CHOICE, desired_error=desired), choice=choice)
    outlook = session.outlook()
    while not outlook.is_enough and len(session) < 2 * MOST:
        number = len(session) + 1
        row = cell.measure(PosePlan(q=outlook.q[:1], seed=number, pose=np.array([number])))
        judgement, session = session.judged(row)
        wrong += not judgement.is_good
        outlook = session.outlook()
    reached = _p90(session, choice, fresh, truth)
    needed = float(np.median([_reaching(course, desired) for course in predicted]))
    as_true = float(np.median([_reaching(course, reached) for course in true]))
    return len(session), needed, as_true, outlook.p90[0] / reached, wrong


def run(robots: int = ROBOTS) -> list[tuple[str, float, str]]:
    """Label, ratio and note of every measured number."""
    found = in_parallel(one_robot, range(robots))
    counts, needed, as_true, honest, called_wrong = zip(*found, strict=True)
    wrong = sum(called_wrong)
    many = f"{np.median(counts):.0f} guided, {np.median(needed):.0f} random (medians)"
    return [
        ("guided / random poses until predicted", float(np.median(np.divide(counts, needed))), many),
        (
            "guided / random poses to the same true error",
            float(np.median(np.divide(counts, as_true))),
            f"{np.median(as_true):.0f} random (median), at most {MOST} counted",
        ),
        (
            "predicted / true p90 where it says stop",
            float(np.median(honest)),
            f"{min(honest):.2f} to {max(honest):.2f}",
        ),
        ("rows called wrong that are not, %", 100 * wrong / sum(counts), f"{wrong} of {sum(counts)}"),
    ]


def _reaching(errors: list[float], wanted: float) -> float:
    """Number of poses after which errors by `COUNTS` are as wanted, between two of them in proportion."""
    below = np.flatnonzero(np.array(errors) <= wanted)
    if not len(below):
        return float(MOST)
    k = int(below[0])
    if k == 0:
        return float(COUNTS[0])
    return float(np.interp(-wanted, [-errors[k - 1], -errors[k]], COUNTS[k - 1 : k + 1]))


def _p90(session: GuidedSession, choice: PoseChoice, fresh: PosePlan, truth: np.ndarray) -> float:
    analysis = session.analysis
    assert analysis is not None and analysis.estimate is not None
    predicted = analysis.estimate.predicted(choice.rows(session.model, fresh.q, session.rows))[0]
    return float(np.quantile(np.linalg.norm(predicted - truth, axis=1), 0.9))
