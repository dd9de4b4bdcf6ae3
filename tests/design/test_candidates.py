import numpy as np
from refusals import refused

from flexcal.design.poses import preloaded, random_candidates
from flexcal.design.scene import CollisionChecker, MeasuringSetup, visible
from flexcal.model.kinematics import joint_ranges, point_kinematics
from flexcal.model.kinematics.joint_space import LIMIT_MARGIN
from flexcal.model.robot import AcceptanceConfig
from flexcal.units import DEGREE


def test_every_candidate_passes_every_check(tx90l, rng):
    checker = CollisionChecker(tx90l)
    q = random_candidates(checker, 300, rng, preload=True)
    assert q.shape == (300, 6)
    lower, upper = joint_ranges(tx90l)
    assert np.all((q >= lower) & (q <= upper))
    assert not checker.collides(q).any()
    assert visible(checker, q).all()
    assert preloaded(tx90l, q).all()
    assert point_kinematics(tx90l, q).position[:, 2].min() > 0


def test_ranges_keep_off_the_limits(tx90l):
    lower, upper = joint_ranges(tx90l)
    low = np.array([j.lower for j in tx90l.joints])
    high = np.array([j.upper for j in tx90l.joints])
    np.testing.assert_allclose(lower - low, LIMIT_MARGIN * (high - low))
    np.testing.assert_allclose(high - upper, LIMIT_MARGIN * (high - low))


def test_the_same_seed_gives_the_same_poses(tx90l):
    checker = CollisionChecker(tx90l)
    one, two = (random_candidates(checker, 50, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_an_impossible_wish_says_what_threw_the_poses_out(tx90l, rng):
    checker = CollisionChecker(tx90l)
    narrow = AcceptanceConfig((1.0, 0.0, 0.0), 0.001 * DEGREE)
    with refused("E-DESIGN-021", "20", "visibility threw out"):
        random_candidates(checker, 20, rng, MeasuringSetup(acceptance=narrow))
