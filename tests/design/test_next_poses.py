from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.data.poses import PoseSet
from flexcal.design.poses import pose_candidates, pose_sensitivity, random_poses, select_next_poses


def _measured(q, sigma=2e-5, **other):
    count = len(q)
    values = {
        "q": q, "position": np.zeros((count, 3)), "sigma": np.full((count, 3), sigma), "torque": None, "payload": None,
        "target": np.full(count, "smr"), "station": np.full(count, "tracker"), "temperature": None, "pose": np.arange(count),
    }  # fmt: skip
    return PoseSet(**values | other)


@pytest.fixture(scope="module")
def found(tx90l):
    return pose_candidates(tx90l, rng=np.random.default_rng(5), candidates=120)


@pytest.fixture(scope="module")
def measured(tx90l):
    return _measured(random_poses(tx90l, 14, np.random.default_rng(6)).q)


def _error(tx90l, found, measured, chosen):
    """Predicted tool error from scratch: all rows stacked, whitened here, and one inverse."""
    full = pose_sensitivity(tx90l, measured.q, found.setup).jacobian
    position = np.linalg.norm(_places(tx90l, measured.q) - [2.5, 0, 1], axis=1)
    full = full * found.setup.noise.std(position)[:, None, None] / measured.sigma[:, :1, None]
    known = found.base.columns(full).reshape(-1, len(found.base.scale))
    like_these = np.median(measured.sigma[:, 0] / found.setup.noise.std(position))
    others = found.base.sensitivity.jacobian[list(chosen)].reshape(-1, len(found.base.scale)) / like_these
    rows = np.vstack([known, others])
    covariance = np.linalg.inv(rows.T @ rows + found.base.sensitivity.prior_information)
    return np.sqrt(np.trace(found.tool_error_weight @ covariance))


def _places(model, q):
    from flexcal.model.kinematics import point_kinematics

    return point_kinematics(model, q, jacobians=False).position


def test_each_pose_is_the_best_of_all_after_those_before(tx90l, found, measured, rng):
    after = select_next_poses(found, measured, 3, rng=rng)
    chosen = after.design.selection.chosen.tolist()
    for number in range(3):
        before = chosen[:number]
        assert after.tool_error[number] == pytest.approx(_error(tx90l, found, measured, before), rel=1e-6)
        others = {i: _error(tx90l, found, measured, [*before, i]) for i in range(120) if i not in before}
        assert min(others, key=others.__getitem__) == chosen[number]
    np.testing.assert_array_equal(after.design.plan.q, found.pool.q[chosen])
    assert after.measured == 14


def test_when_to_stop(tx90l, measured, rng):
    many = pose_candidates(tx90l, rng=rng, candidates=1500)
    after = select_next_poses(many, measured, 60, rng=rng)
    assert np.all(np.diff(after.tool_error) < 0) and np.all(after.possible <= after.tool_error)
    wanted = float(after.tool_error[7])
    assert after.enough(wanted) == 7 and after.enough(2 * after.tool_error[0]) == 0
    assert after.enough(0.1 * after.tool_error[-1]) is None
    stop = after.enough()
    assert stop is not None and 0 < stop < 60
    # from there on nothing beats averaging by more than a fifth
    averaged = after.tool_error[stop] * np.sqrt((14 + stop) / (14 + np.arange(stop, 61)))
    assert np.all(after.tool_error[stop:] > averaged / 1.22)


def test_payloads_and_unknown_noise(tx90l, found, measured, rng):
    held = np.where(np.arange(14) < 7, 0.0, 6.0)
    two = select_next_poses(found, replace(measured, payload=held), 2, rng=rng)
    declared = select_next_poses(found, replace(measured, payload=np.full(14, 6.0)), 2, rng=rng)
    plain = select_next_poses(found, measured, 2, rng=rng)
    np.testing.assert_allclose(declared.tool_error, plain.tool_error, rtol=1e-12)
    assert two.tool_error[0] != pytest.approx(plain.tool_error[0], rel=1e-9)
    vague = select_next_poses(found, replace(measured, sigma_given=False), 2, rng=rng)
    rows = found.base.columns(pose_sensitivity(tx90l, measured.q, found.setup).jacobian).reshape(-1, 29)
    covariance = np.linalg.inv(rows.T @ rows + found.base.sensitivity.prior_information)
    assert vague.tool_error[0] == pytest.approx(
        np.sqrt(np.trace(found.tool_error_weight @ covariance)), rel=1e-6
    )


def test_bad_input(found, measured, rng):
    with refused("E-DESIGN-029", "O3"):
        select_next_poses(found, measured, 2, rng=rng, criterion="O3")
    with refused("E-DESIGN-031", "target", "ball", "smr"):
        select_next_poses(found, replace(measured, target=np.full(14, "ball")), 2, rng=rng)
    with refused("E-DESIGN-031", "station", "door"):
        select_next_poses(found, replace(measured, station=np.full(14, "door")), 2, rng=rng)
    with refused("E-DESIGN-030"):
        select_next_poses(found, replace(measured, kind=np.full(14, "distance")), 2, rng=rng)
    with refused("E-DESIGN-017", "121", "120"):
        select_next_poses(found, measured, 121, rng=rng)
