from itertools import pairwise, permutations

import numpy as np
import pytest

from flexcal.design.poses import measurement_order
from flexcal.design.poses.ordering import move_collides, move_seconds
from flexcal.design.scene import CollisionChecker
from flexcal.model.robot import RobotModel

LINK = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>{}</link>'
BOX = '<collision><origin xyz="{}"/><geometry><box size="{}"/></geometry></collision>'
JOINT = (
    '<joint name="{}" type="revolute"><origin xyz="{}"/><parent link="{}"/><child link="{}"/><axis xyz="0 0 1"/>'
    '<limit lower="-3" upper="3" effort="1" velocity="{}"/></joint>'
)
POSES = np.array([[-1.2, 0.3], [1.2, -0.3], [-0.8, 0.1], [0.7, 0.2], [2.0, -1.0], [-2.0, 1.5]])


@pytest.fixture(scope="module")
def checker(tmp_path_factory):
    """Two links that turn about z above the floor, and a post that stands before them."""
    folder = tmp_path_factory.mktemp("post")
    links = [
        LINK.format("base", ""),
        LINK.format("one", BOX.format("0.5 0 1", "1 .05 .05")),
        LINK.format("two", BOX.format("0.3 0 1", ".6 .05 .05")),
    ]
    joints = [JOINT.format("a", "0 0 0", "base", "one", 2), JOINT.format("b", "1 0 0", "one", "two", 0.5)]
    (folder / "arm.urdf").write_text(f'<robot name="arm">{"".join(links + joints)}</robot>')
    post = LINK.format("post", BOX.format("1.3 0 1", ".1 .1 1"))
    (folder / "post.urdf").write_text(f'<robot name="post">{post}</robot>')
    (folder / "robot.yaml").write_text(
        "robot: arm.urdf\npoints: {tip: {frame: two, xyz: [0.6, 0, 1]}}\nobstacles: [post.urdf]\n"
    )
    return CollisionChecker(RobotModel.from_yaml(folder / "robot.yaml"))


def test_a_move_takes_as_long_as_its_slowest_joint(checker):
    seconds = move_seconds(checker, np.array([[0.0, 0.0], [1.0, 0.1], [0.2, -0.4]]))
    np.testing.assert_allclose(seconds, [[0, 0.5, 0.8], [0.5, 0, 1.0], [0.8, 1.0, 0]])


def test_a_straight_move_through_the_post_is_blocked(checker):
    side, other = np.array([-1.0, 0.0]), np.array([1.0, 0.0])
    assert not checker.collides(np.stack([side, other])).any()
    assert move_collides(checker, side, other) and move_collides(checker, other, side)
    assert not move_collides(checker, side, np.array([-0.6, 0.0]))
    assert not move_collides(checker, np.array([-1.0, 2.6]), np.array([1.0, 2.6]))  # folded, it passes beside


def test_a_thin_move_does_not_slip_between_samples(checker, rng):
    """Against a hundred times as many configurations on the way."""
    free = rng.uniform(-2.5, 2.5, (25, 2))
    free = free[~checker.collides(free)]
    without_margin = CollisionChecker(checker.model, margin=0.0)
    for start, end in pairwise(free):
        fine = start + np.linspace(0, 1, 4000)[:, None] * (end - start)
        if without_margin.collides(fine).any():
            assert move_collides(checker, start, end)


def test_the_order_against_every_order(checker):
    """As few blocked moves as there can be, and then as little time."""
    assert not checker.collides(POSES).any()
    seconds = move_seconds(checker, POSES)
    touching = np.array([[move_collides(checker, a, b) for b in POSES] for a in POSES])
    found = measurement_order(checker, POSES)
    assert sorted(found.order) == list(range(6))
    ways = [np.array(way) for way in permutations(range(6))]
    least = min((touching[w[:-1], w[1:]].sum(), seconds[w[:-1], w[1:]].sum()) for w in ways)
    assert least[0] > 0  # the post parts the poses
    np.testing.assert_array_equal(found.blocked, touching[found.order[:-1], found.order[1:]])
    np.testing.assert_allclose(found.seconds, seconds[found.order[:-1], found.order[1:]])
    assert found.blocked.sum() == least[0]
    assert found.seconds.sum() == pytest.approx(least[1])


def test_the_tx90l_moves_half_as_long(tx90l, rng):
    from flexcal.design.poses import random_candidates

    checker = CollisionChecker(tx90l)
    q = random_candidates(checker, 30, rng)
    found = measurement_order(checker, q)
    seconds = move_seconds(checker, q)
    assert found.seconds.sum() < 0.6 * seconds[np.arange(29), np.arange(1, 30)].sum()
    assert not found.blocked.any()
