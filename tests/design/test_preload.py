import numpy as np

from flexcal.design.poses import preloaded
from flexcal.design.poses.gravity_preload import preload_joints
from flexcal.model.statics import gravity_torque


def test_preloaded_poses_keep_their_flank_whatever_the_inertials(tx90l, rng):
    q = rng.uniform(-2, 2, (2000, 6))
    loose = list(preload_joints(tx90l))
    assert loose == [1, 2]
    sure = preloaded(tx90l, q)
    nominal = gravity_torque(tx90l, q)[:, loose]
    assert np.abs(nominal[sure]).min() > 10
    assert 0.8 < sure.mean() < 1
    wrong, unsure = 0, 0
    for _ in range(10):
        values = {
            f"{j.link}.mass": tx90l.value(f"{j.link}.mass") * (1 + 0.07 * rng.normal()) for j in tx90l.joints
        }
        values |= {
            f"{j.link}.com_x": tx90l.value(f"{j.link}.com_x") + 0.01 * rng.normal() for j in tx90l.joints
        }
        values |= {
            f"{j.link}.com_z": tx90l.value(f"{j.link}.com_z") + 0.01 * rng.normal() for j in tx90l.joints
        }
        flipped = np.sign(gravity_torque(tx90l.with_values(values), q)[:, loose]) != np.sign(nominal)
        wrong += flipped[sure].sum()
        unsure += flipped[~sure].sum()
    assert wrong == 0
    assert unsure > 0


def test_without_backlash_every_pose_will_do(ur5, rng):
    assert preloaded(ur5, rng.uniform(-3, 3, (5, 6))).all()


def test_the_payload_changes_what_is_sure(tx90l, rng):
    q = rng.uniform(-2, 2, (500, 6))
    assert np.any(preloaded(tx90l, q, 0.0) != preloaded(tx90l, q, 6.0))
