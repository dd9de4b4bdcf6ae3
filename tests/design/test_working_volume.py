import numpy as np
import pytest
from refusals import refused

from flexcal.design.poses import (
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
    random_poses,
    select_poses,
    working_box,
    working_points,
)
from flexcal.design.poses.feasibility import tool_error_weight
from flexcal.design.poses.selection import tool_error
from flexcal.design.scene import CollisionChecker
from flexcal.model.kinematics import joint_ranges, point_kinematics

LOWER, UPPER = np.array([0.5, -0.2, 0.3]), np.array([0.9, 0.2, 0.7])


@pytest.fixture(scope="module")
def box(tx90l):
    return working_box(CollisionChecker(tx90l), LOWER, UPPER, np.random.default_rng(1))


def test_the_arm_works_all_over_the_box(tx90l, box):
    there = point_kinematics(tx90l, box.q, jacobians=False).position
    np.testing.assert_allclose(there, box.points, atol=1e-4)
    assert np.all((there > LOWER - 1e-4) & (there < UPPER + 1e-4))
    assert box.reached > 0.95 and len(box.q) == round(300 * box.reached)
    np.testing.assert_allclose(np.ptp(there, axis=0), UPPER - LOWER, rtol=0.05)
    lower, upper = joint_ranges(tx90l)
    assert np.all((box.q >= lower) & (box.q <= upper))
    assert not CollisionChecker(tx90l).collides(box.q).any()


def test_points_are_reached_each_in_its_place(tx90l):
    points = np.array([[0.6, 0.0, 0.5], [-0.4, 0.5, 0.9], [0.2, -0.8, 0.4]])
    found = working_points(CollisionChecker(tx90l), points, np.random.default_rng(2))
    np.testing.assert_allclose(point_kinematics(tx90l, found.q, jacobians=False).position, points, atol=1e-4)


def test_the_criterion_is_the_directly_predicted_error_in_the_volume(tx90l, box, rng):
    """Root mean square over the working poses of the tool's error, from the covariance of the calibrated parameters, pose by pose."""
    q = random_poses(tx90l, 60, rng).q
    base = base_sensitivity(pose_sensitivity(tx90l, q))
    chosen = np.arange(25)
    rows = base.sensitivity.jacobian[chosen].reshape(-1, len(base.scale))
    covariance = np.linalg.inv(rows.T @ rows + base.sensitivity.prior_information)
    squares = []
    for pose in box.q[:40]:
        _, jacobian = geometry_jacobian(tx90l, pose[None])
        kept = jacobian[0][:, list(base.identifiability.kept)] * base.scale
        squares.append(np.trace(kept @ covariance @ kept.T))
    weight = tool_error_weight(base.columns(geometry_jacobian(tx90l, box.q[:40])[1]))
    assert tool_error(base, weight, chosen) == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-6)


def test_poses_chosen_for_the_volume_are_better_there(tx90l, box):
    there, anywhere = (
        select_poses(tx90l, 15, rng=np.random.default_rng(2), candidates=600, working=working)
        for working in (box.q, None)
    )
    elsewhere = tool_error(anywhere.base, there.tool_error_weight, anywhere.selection.chosen)
    assert there.tool_error < 0.95 * elsewhere


def test_bad_input(tx90l, rng):
    checker = CollisionChecker(tx90l)
    with refused("E-DESIGN-032"):
        working_box(checker, UPPER, LOWER, rng)
    with refused("E-DESIGN-033", "5, 5, 0"):
        working_box(checker, np.array([5.0, 5, 0]), np.array([6.0, 6, 1]), rng)
    points = np.array([[0.6, 0.0, 0.5], [4.0, 0.0, 0.5]])
    with refused("E-DESIGN-034", "2", "4, 0, 0.5", "1", "2"):
        working_points(checker, points, rng)
