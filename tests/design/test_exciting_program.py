"""Derivatives of criteria, distances and limits against differences; motions that keep what they are meant to keep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.design.optimality import condition_number
from flexcal.design.scene import Clearance, CollisionChecker
from flexcal.design.trajectories import (
    NEAR,
    BaseRegressor,
    TrajectoryCriterion,
    optimise_trajectories,
    sequence,
)
from flexcal.design.trajectories.criterion import excitation_criterion
from flexcal.design.trajectories.excitation_problem import ExcitationProblem
from flexcal.design.trajectories.feasible_start import feasible_postures, feasible_start_motion
from flexcal.design.trajectories.limit_usage import MotionLimits
from flexcal.design.trajectories.motion_space import MotionSpace
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.robot.config import BoxConfig, LimitsConfig


def program(
    model: RobotModel, criterion: TrajectoryCriterion = "condition", **space: object
) -> ExcitationProblem:
    columns = BaseRegressor.of(model, None if criterion == "c" else 0.0)
    limits = MotionLimits.of(model)
    of = ("payload.mass", "link_3.com_x") if criterion == "c" else ()
    goal = excitation_criterion(columns, criterion, of, np.ones(columns.rank), 400.0)
    motions = MotionSpace.of("fourier", 5, 10.0, 100, limits, **space)
    clearance = Clearance(CollisionChecker(model), NEAR)
    return ExcitationProblem(motions, columns, goal, np.full(model.n, 0.01), limits, clearance)


def slope(f: Callable[[np.ndarray], float], x: np.ndarray, way: np.ndarray, step: float) -> float:
    """Along `way`, by central differences of sixth order."""
    odd = [f(x + k * step * way) - f(x - k * step * way) for k in (1, 2, 3)]
    return float(np.array(odd) @ [45, -9, 1]) / (60 * step)


def begin(problem: ExcitationProblem, seed: int) -> np.ndarray:
    return feasible_start_motion(problem, feasible_postures(problem), np.random.default_rng(seed))


@pytest.mark.parametrize("criterion", ["condition", "D", "E", "A", "posterior", "c"])
def test_gradients_of_criteria_are_exact(tx90l: RobotModel, criterion: TrajectoryCriterion) -> None:
    """To 1e-8, along random directions, against differences of sixth order."""
    problem = program(tx90l, criterion)
    goal, columns, motions = problem.merit, problem.columns, problem.space
    rng = np.random.default_rng(2)
    x = 0.3 * rng.standard_normal(motions.shape)

    def merit(at: np.ndarray) -> float:
        return goal.merit(problem.information(motions.motion(at)))

    motion = motions.motion(x)
    by_columns = (
        2e-4 / motions.instants * (goal.gradient(problem.information(motion)) @ columns.write(motion))
    )
    gradient = motions.by_coordinates(columns.by_motion(motion, by_columns)).reshape(x.shape)
    for way in rng.standard_normal((3, *x.shape)) / np.sqrt(x.size):
        expected = slope(merit, x, way, 2e-4)
        assert abs(np.sum(gradient * way) - expected) < 1e-8 * np.linalg.norm(gradient)


def test_distances_are_those_of_all_pairs_and_their_derivatives_right(tx90l: RobotModel) -> None:
    """After many small steps, in which most pairs are not computed again, against a fresh look at all."""
    checker = CollisionChecker(tx90l)
    lazy, rng = Clearance(checker, 0.2), np.random.default_rng(4)
    q = rng.uniform(-1.2, 1.2, (40, 6))
    for _ in range(12):
        q = q + 0.04 * rng.standard_normal(q.shape)
        instants, distances, _ = lazy.near(q)
        again = Clearance(checker, 0.2).near(q)
        np.testing.assert_array_equal(instants, again[0])
        np.testing.assert_allclose(distances, again[1], atol=1e-5)
    np.testing.assert_array_equal(np.isin(np.arange(40), instants[distances < 0]), checker.collides(q))
    assert len(distances) > 40
    wide = Clearance(checker, 9.0)
    instants, distances, slopes = wide.near(q)
    way = rng.standard_normal(q.shape)
    ahead, behind = (wide.near(q + sign * 1e-3 * way)[1] for sign in (1, -1))
    expected, found = (ahead - behind) / 2e-3, np.sum(slopes * way[instants], axis=1)
    apart = np.abs(found - expected)[distances > 0.02]
    assert np.quantile(apart, 0.95) < 2e-3  # nearest points jump at edges, where there is no derivative


def limited(model: RobotModel) -> RobotModel:
    limits = LimitsConfig((20.0,) * 6, 1.5, BoxConfig((-1.0, -1.0, 0.2), (1.0, 1.2, 2.0)))
    return replace(model, config=replace(model.config, limits=limits))


def test_the_barrier_of_all_limits_has_the_right_gradient(tx90l: RobotModel) -> None:
    """With limits of acceleration, box and speed; bodies, whose distances coal knows to 1e-6 m, on their own."""
    whole = program(limited(tx90l))
    x = begin(whole, 1)
    way = np.random.default_rng(3).standard_normal(x.size)
    expected = slope(lambda at: whole.evaluate(at, 0.3).value, x, way, 2e-4)
    assert whole.evaluate(x, 0.3).gradient() @ way == pytest.approx(expected, rel=5e-3)
    problem = replace(whole, clearance=Clearance(whole.clearance.checker, 0.0))
    found = problem.evaluate(x, 0.3)
    rng = np.random.default_rng(0)
    for way in rng.standard_normal((3, x.size)):
        expected = slope(lambda at: problem.evaluate(at, 0.3).value, x, way, 1e-4)
        assert found.gradient() @ way == pytest.approx(expected, rel=1e-6)


def test_every_limit_holds_between_the_instants(tx90l: RobotModel) -> None:
    """Torques by Pinocchio with the worst Coulomb friction, on a grid that has nothing to do with the design's."""
    import pinocchio as pin

    model = limited(tx90l)
    design = optimise_trajectories(model, criterion="D", payload=0.0, starts=1, steps=15, seed=11)
    time = np.linspace(0, 10, 3001)
    q, dq, ddq = design.plan.motion(0, time)
    robot = pin.buildModelFromUrdf(str(model.urdf))
    data = robot.createData()
    torque = np.array([pin.rnea(robot, data, *state) for state in zip(q, dq, ddq, strict=True)])
    torque += (
        model.drives.rotor_inertia * ddq + model.drives.viscous * dq + model.drives.coulomb * np.sign(dq)
    )
    for i, joint in enumerate(model.joints):
        assert joint.lower < q[:, i].min() and q[:, i].max() < joint.upper
        assert np.abs(dq[:, i]).max() < joint.velocity * 1.0005
        assert np.abs(torque[:, i]).max() < joint.effort * 1.0005
    assert np.abs(ddq).max() < 20.0 * 1.0005
    seen = point_kinematics(model, q).position
    assert (seen > [-1.0, -1.0, 0.2]).all() and (seen < [1.0, 1.2, 2.0]).all()
    assert np.linalg.norm(np.diff(seen, axis=0), axis=1).max() / time[1] < 1.5 * 1.001
    assert not CollisionChecker(model, margin=0.0099).collides(q).any()
    used = max(np.abs(dq).max() / 20, np.abs(torque / [j.effort for j in model.joints]).max())
    assert used > 0.5  # else the limits would be kept by standing still


@pytest.mark.statistical
def test_better_than_the_best_of_many_random_motions(tx90l: RobotModel) -> None:
    problem = program(tx90l)
    drawn = [
        condition_number(problem.information(problem.space.motion(begin(problem, seed))))
        for seed in range(25)
    ]
    design = optimise_trajectories(tx90l, payload=0.0, starts=1, steps=15, seed=5)
    assert condition_number(design.information[0]) < 0.7 * min(drawn)


def test_splines_from_rest_at_a_start_and_stages_whose_joints_stand(tx90l: RobotModel) -> None:
    start = np.array([0.1, 0.3, 0.5, 0.0, 0.2, 0.0])
    rested = optimise_trajectories(
        tx90l, criterion="A", kind="spline", harmonics=4, start=start, payload=0.0, starts=1, steps=3
    )
    q, dq, ddq = rested.plan.motion(0, np.array([0.0, 10.0, 3.3]))
    np.testing.assert_allclose(q[:2], [start, start], atol=1e-9)
    np.testing.assert_allclose([dq[:2], ddq[:2]], 0.0, atol=1e-9)
    assert np.abs(dq[2]).min() > 1e-3
    stages = sequence(BaseRegressor.of(tx90l), "axes")
    assert [stage.moving for stage in stages] == [(3, 4, 5), (0, 1, 2, 3, 4, 5)]
    staged = optimise_trajectories(tx90l, criterion="D", sequence=stages, payload=0.0, starts=1, steps=3)
    speed = np.abs(staged.plan.motion(0, np.linspace(0, 10, 50))[1]).max(axis=0)
    assert (speed[:3] < 1e-12).all() and (speed[3:] > 0.1).all()


def test_what_is_known_already_is_not_sought_again(tx90l: RobotModel) -> None:
    """After one plan, the same criterion grows by less, and information adds up."""
    first = optimise_trajectories(tx90l, criterion="posterior", payload=0.0, starts=1, steps=4, seed=1)
    second = optimise_trajectories(
        tx90l, criterion="posterior", payload=0.0, starts=1, steps=4, seed=2, after=first.plan
    )
    assert second.merits[0] > first.merits[0]
    added = second.information[0] - first.information[0]
    assert np.linalg.eigvalsh(added)[0] > -1e-3 * np.linalg.eigvalsh(added)[-1]


def test_a_robot_too_weak_to_stand_is_told_its_joint(tx90l: RobotModel) -> None:
    weak = tuple(replace(j, effort=33.0) if j.name == "joint_2" else j for j in tx90l.joints)
    with refused("E-DESIGN-043", "joint_2 needs", "N m at rest"):
        optimise_trajectories(replace(tx90l, joints=weak))
