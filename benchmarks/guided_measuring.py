"""Guided measuring against random poses on the virtual TX90L: how many poses until the calibrated robot is as accurate; 10 robots, minutes.

A guided session measures the pose that it names best until it says stop. Its error then, the 90 % quantile against noise-free points at
200 fresh poses over the workspace, is the target; counted is after how many random poses the same estimate reaches it, the median of two
plans.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal import PosePlan, RobotModel, VirtualCell
from flexcal.design.poses import random_candidates
from flexcal.design.scene import CollisionChecker
from flexcal.jobs.guidance import GuidedSession, PoseChoice
from flexcal.virtual_cell import CellConfig

ROBOT = Path(__file__).parents[1] / "examples" / "tx90l" / "robot.yaml"
ROBOTS, MOST, STEP, PLANS = 10, 120, 5, 2


def run(robots: int = ROBOTS) -> list[tuple[str, float, str]]:
    """Label, ratio and note of every measured number."""
    model, choice = RobotModel.from_yaml(ROBOT, estimates=False), None
    counts, needed, honest, wrong, rows = [], [], [], 0, 0
    for seed in range(robots):
        cell = VirtualCell.drawn(model, CellConfig(), seed)[0]
        session = GuidedSession(model, choice=choice)
        choice = session.candidates
        fresh = PosePlan(
            q=random_candidates(CollisionChecker(model), 200, np.random.default_rng(1000 + seed))
        )
        truth = cell.noise_free(fresh)
        outlook = session.outlook()
        while not outlook.is_enough and len(session) < MOST:
            number = len(session) + 1
            row = cell.measure(PosePlan(q=outlook.q[:1], seed=number, pose=np.array([number])))
            judgement, session = session.judged(row)
            wrong, rows = wrong + (not judgement.is_good), rows + 1
            outlook = session.outlook()
        target = _p90(session, choice, fresh, truth)
        counts.append(len(session))
        honest.append(outlook.p90[0] / target)
        needed.append(
            np.median([_random(model, cell, choice, fresh, truth, target, seed, k) for k in range(PLANS)])
        )
    ratio = float(np.median(np.array(counts) / np.array(needed)))
    many = f"{np.median(counts):.0f} guided, {np.median(needed):.0f} random (medians)"
    return [
        ("poses of a guided session / random poses", ratio, many),
        (
            "predicted / true p90 where it says stop",
            float(np.median(honest)),
            f"{min(honest):.2f} to {max(honest):.2f}",
        ),
        ("rows called wrong that are not, %", 100 * wrong / rows, f"{wrong} of {rows}"),
    ]


def _random(
    model: RobotModel,
    cell: VirtualCell,
    choice: PoseChoice,
    fresh: PosePlan,
    truth: np.ndarray,
    target: float,
    seed: int,
    plan: int,
) -> float:
    """Number of random poses, by steps, after which the error is at most the target."""
    rng = np.random.default_rng([seed, plan])
    q = random_candidates(CollisionChecker(model), MOST, rng, preload=True)
    measured = cell.measure(PosePlan(q=q, seed=10_000 + plan))
    for count in range(15, MOST + 1, STEP):
        session = GuidedSession(model, rows=measured.subset(slice(0, count)), choice=choice)
        if _p90(session, choice, fresh, truth) <= target:
            return float(count)
    return float(MOST + STEP)


def _p90(session: GuidedSession, choice: PoseChoice, fresh: PosePlan, truth: np.ndarray) -> float:
    analysis = session.analysis
    assert analysis is not None and analysis.estimate is not None
    predicted = analysis.estimate.predicted(choice.rows(session.model, fresh.q, session.rows))[0]
    return float(np.quantile(np.linalg.norm(predicted - truth, axis=1), 0.9))
