"""Exciting trajectories keep every limit, touch nothing, and tell more than a random one."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.data import TrajectoryPlan
from flexcal.design import CollisionChecker, design_trajectories
from flexcal.model import RobotModel, inertial_parameters, torque_regressor
from flexcal.model.declared import declared, uncertain_inertials
from flexcal.yaml_writer import to_plain


@pytest.fixture(scope="module")
def plan(tx90l: RobotModel) -> TrajectoryPlan:
    return design_trajectories(tx90l, 2, candidates=30, seed=3, payload=0.0)


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
        torque += tx90l.rotor_inertia * ddq + tx90l.viscous * dq + tx90l.coulomb * np.sign(dq)
        assert (np.abs(torque).max(axis=0) < 0.85 * np.array([j.effort for j in tx90l.joints])).all()
        assert not checker.collides(q[::5]).any()


def test_the_seed_decides_everything(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    assert to_plain(design_trajectories(tx90l, 2, candidates=30, seed=3, payload=0.0)) == to_plain(plan)
    assert to_plain(design_trajectories(tx90l, 2, candidates=30, seed=4, payload=0.0)) != to_plain(plan)


def test_the_chosen_ones_tell_more(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    """Posterior volume of the links' inertials, computed here from Jacobians by finite differences of the torques."""
    chosen = information(tx90l, plan)
    drawn = [
        information(tx90l, design_trajectories(tx90l, 2, candidates=2, seed=seed, payload=0.0))
        for seed in range(8)
    ]
    assert chosen > np.median(drawn) + 3.0


def information(model: RobotModel, plan: TrajectoryPlan) -> float:
    """log det of 1 + the information in units of the prior."""
    names = uncertain_inertials(model, range(model.n))
    time = np.arange(100) / 100 / plan.base_frequency_hz
    efforts = 1e-3 * np.array([joint.effort for joint in model.joints])
    total = np.eye(len(names))
    for number in range(len(plan)):
        states = plan.motion(number, time)
        start = torque_regressor(model, *states) @ inertial_parameters(model)
        columns = []
        for name in names:
            item = declared(model, name)
            moved = model.with_values(
                {name: item.natural(item.coordinate(item.value) + 1e-3 * item.prior_std)}
            )
            change = (torque_regressor(moved, *states) @ inertial_parameters(moved) - start) / 1e-3
            columns.append((change / efforts).ravel())
        jacobian = np.array(columns).T
        total += jacobian.T @ jacobian
    return float(np.linalg.slogdet(total)[1])
