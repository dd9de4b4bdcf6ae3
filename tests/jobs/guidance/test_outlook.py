"""Next poses and the predicted error, against what fresh poses of a real UR5 and of the virtual cell say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal import PosePlan, PoseRequest, RobotModel, VirtualCell, read_poses
from flexcal.data.poses import PosePool
from flexcal.design.poses import WorkingVolume, usable
from flexcal.design.scene import CollisionChecker
from flexcal.jobs.guidance import GuidedSession
from flexcal.jobs.guidance.outlook import FIRST
from flexcal.model.kinematics import joint_ranges
from flexcal.virtual_cell import CellConfig, MismatchConfig


def test_a_real_robot_guided_through_its_measured_poses(ur5: RobotModel, examples: Path):
    """No row is called wrong, it says stop, and the p90 at 300 other poses is the predicted one within a third."""
    every = read_poses(examples / "ur5_tracker" / "grid.csv", ur5)
    order = np.random.default_rng(2).permutation(len(every))
    fresh, rest = every.subset(order[:300]), every.subset(order[300:])
    row_of = {int(number): k for k, number in enumerate(rest.pose)}
    working = WorkingVolume(rest.q[:200], rest.position[:200])
    request = PoseRequest(candidates=PosePool(rest.q, rest.pose), working=working)
    session = GuidedSession(ur5, request=request)
    outlook = session.outlook()
    assert not outlook.is_enough and outlook.sentence.startswith("go on: too few rows")
    while not outlook.is_enough and len(session) < 60:
        judgement, session = session.judged(rest.subset([row_of[int(outlook.pose[0])]]))
        assert judgement.is_good, judgement.sentence
        outlook = session.outlook()
    assert 15 <= len(session) <= 45 and not session.findings
    assert outlook.sentence.startswith("stop: p90 predicted") and "in the working volume" in outlook.sentence
    estimate = session.analysis.estimate
    error = np.linalg.norm(estimate.predicted(fresh)[0] - fresh.position, axis=1)
    assert outlook.p90[0] == pytest.approx(np.quantile(error, 0.9), rel=1 / 3)


@pytest.fixture(scope="module")
def tx90l(examples: Path) -> RobotModel:
    return RobotModel.from_yaml(examples / "tx90l" / "robot.yaml", estimates=False)


def test_next_poses_can_be_taken(tx90l: RobotModel):
    cell = VirtualCell.drawn(tx90l, CellConfig(mismatch=MismatchConfig(repeatability=6e-5)), 1)[0]
    session = GuidedSession(tx90l)
    first = session.next_poses(25)
    assert not CollisionChecker(tx90l).collides(first).any()
    session = session.with_rows(cell.measure(PosePlan(q=first)))
    outlook = session.outlook()
    assert (np.diff(outlook.p90) < 0).all() and outlook.is_known
    # none of those is a pose that was measured
    assert np.abs(outlook.q[:, None] - first[None]).max(axis=2).min() > 0.01
    now, then, alone = (
        f"{1e3 * value:.3f} mm" for value in (outlook.p90[0], outlook.p90[-1], outlook.scatter)
    )
    assert outlook.sentence == (
        f"go on: p90 predicted {now} anywhere in the workspace, with 10 more poses about {then}; "
        f"the scatter of robot and instrument alone is {alone}."
    )


def test_the_desired_error(tx90l: RobotModel):
    """What is told beforehand to reach it is the number of poses after which it is predicted to be reached."""
    cell = VirtualCell.drawn(tx90l, CellConfig(), 1)[0]
    measured = cell.measure(PosePlan(q=GuidedSession(tx90l).next_poses(25)))
    session = GuidedSession(tx90l, rows=measured, request=PoseRequest(candidates=500))
    prospect = session.prospect()
    enough = prospect.outlook(desired=1.01 * prospect.p90)
    assert enough.is_enough and enough.sentence.startswith("stop") and len(enough.q) == 10
    near = prospect.outlook(desired=0.9 * prospect.p90)
    count = int(np.flatnonzero(near.p90 <= near.desired)[0])
    assert not near.is_enough and f"are reached in {count} more pose" in near.sentence and len(near.q) == 10
    assert near.p90[count - 1] > near.desired
    far = prospect.outlook(desired=1e-6)
    assert not far.is_enough and "not yet with 10 more poses" in far.sentence


@pytest.mark.statistical
def test_poses_chosen_anywhere_tell_more_than_the_candidates(tx90l: RobotModel):
    """Moved to neighbours, they predict a smaller error than the best of the candidates, and pass the same checks."""
    moved = GuidedSession(tx90l).prospect()
    pool = PosePool(moved.choice.q, moved.choice.pose)
    fixed = replace(moved, choice=replace(moved.choice, checker=None))
    free, bound = moved.outlook(FIRST), fixed.outlook(FIRST)
    assert np.isin(bound.pose, pool.pose).all() and (pool.q[bound.pose - 1] == bound.q).all()
    assert free.p90[-1] < 0.98 * bound.p90[-1]
    checker = moved.choice.checker
    assert checker is not None and usable(checker, free.q, moved.choice.setup, preload=True).all()
    lower, upper = joint_ranges(tx90l)
    assert (free.q >= lower).all() and (free.q <= upper).all()


@pytest.mark.parametrize(
    ("robots", "low", "high"), [(1, 0.5, 2.0), pytest.param(4, 0.7, 1.5, marks=pytest.mark.slow)]
)
def test_the_predicted_error_is_that_of_the_cell(tx90l: RobotModel, robots: int, low: float, high: float):
    """The error against noise-free points at 150 poses over the workspace, 30 rows of every robot."""
    ratios, choice = [], None
    for seed in range(robots):
        cell = VirtualCell.drawn(tx90l, CellConfig(), seed)[0]
        session = GuidedSession(tx90l, choice=choice)
        choice = session.candidates
        session = session.with_rows(cell.measure(PosePlan(q=session.next_poses(30))))
        plan = PosePlan(q=choice.working[:150])
        estimate = session.analysis.estimate
        error = estimate.predicted(choice.rows(tx90l, plan.q, session.rows))[0] - cell.noise_free(plan)
        ratios.append(session.outlook(1).p90[0] / np.quantile(np.linalg.norm(error, axis=1), 0.9))
    assert low < np.exp(np.mean(np.log(ratios))) < high
