"""Exciting trajectories keep every limit, touch nothing, and tell more than a random one."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.data.plans import TrajectoryPlan
from flexcal.design.scene import CollisionChecker
from flexcal.files.formats import to_plain
from flexcal.jobs.experiments import exciting_plan
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_parameters, torque_regressor


@pytest.fixture(scope="module")
def plan(tx90l: RobotModel) -> TrajectoryPlan:
    return exciting_plan(tx90l, count=2, seed=3)


def test_limits_are_kept_and_nothing_touches(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    """On another grid of time than the design's."""
    time = np.arange(733) / 733 / plan.base_frequency_hz
    checker = CollisionChecker(tx90l)
    for number in range(len(plan)):
        q, dq, ddq = plan.motion(number, time)
        for i, joint in enumerate(tx90l.joints):
            assert joint.lower < q[:, i].min() and q[:, i].max() < joint.upper
            assert np.abs(dq[:, i]).max() < 0.82 * joint.velocity
        torque = torque_regressor(tx90l, q, dq, ddq) @ inertial_parameters(tx90l)
        torque += (
            tx90l.drives.rotor_inertia * ddq + tx90l.drives.viscous * dq + tx90l.drives.coulomb * np.sign(dq)
        )
        assert (np.abs(torque).max(axis=0) < 0.85 * np.array([j.effort for j in tx90l.joints])).all()
        assert not checker.collides(q[::5]).any()


def test_the_seed_decides_everything(tx90l: RobotModel) -> None:
    one, other, again = (exciting_plan(tx90l, count=1, seed=seed) for seed in (3, 4, 3))
    assert to_plain(one) == to_plain(again) != to_plain(other)
