"""Stage 2: rank, recovery, agreement of both ways to carry the elasticity, coverage, robustness."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from flexcal.calibration import ElasticPrior, ErrorStatistics, calibrate, predict, verify
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel
from flexcal.model.rotations import vector_rotation


def test_rank_is_29_of_47_with_a_gap_of_many_decades(simulate: Callable) -> None:
    """27 geometric directions of a position-only 6R arm (six axis lines and a point) and two backlashes; the paper keeps 30."""
    found = calibrate(simulate(1).robot, simulate(1).poses).identifiability
    assert (found.rank, len(found.names)) == (29, 47)
    assert found.gap > 9
    assert {"joint_2.backlash", "joint_3.backlash"} <= set(found.kept_names)
    assert all(d.absorbed_by for d in found.dropped)


def test_a_target_on_the_last_axis_loses_two_more(tx90l: RobotModel, simulate: Callable) -> None:
    point = replace(tx90l.point(), xyz=np.array([0.15, 0.0, 0.0]))
    on_axis = replace(tx90l, points={"smr": point})
    simulated = simulate(1)
    poses = replace(simulated.poses, position=predict(on_axis, simulated.poses).position)
    assert calibrate(on_axis, poses).identifiability.rank == 27


def test_noiseless_recovery(simulate: Callable, tx90l: RobotModel) -> None:
    """With the true elasticity, exact points are met to 1 µm, a thirtieth of σ, and the kept parameters are the regrouped truth."""
    simulated = simulate(2, 80, noise=False)
    elastic = {n: v for n, v in simulated.truth.items() if n.startswith("link_") or n.endswith("stiffness")}
    fit = calibrate(tx90l.with_values(elastic), simulated.poses)
    assert fit.errors.max < 1e-6
    expected = fit.estimate.regrouped(simulated.truth)
    for name in fit.identifiability.kept_names:
        np.testing.assert_allclose(fit.estimate.values[name], expected[name], atol=5e-6, err_msg=name)


def test_reestimated_and_marginalised_elasticity_agree(simulate: Callable, tx90l: RobotModel) -> None:
    """R + J Σ Jᵀ in the residual covariance, or the same parameters re-estimated with Σ as prior: equal to first order."""
    simulated = simulate(4, 50)
    joint = calibrate(tx90l, simulated.poses)
    marginal = calibrate(tx90l, simulated.poses, elasticity="marginalised")
    for name in joint.identifiability.kept_names:
        a, b = joint.estimate.std(name), marginal.estimate.std(name)
        assert a is not None and b is not None
        np.testing.assert_allclose(a, b, rtol=0.05)
        assert abs(joint.estimate.values[name] - marginal.estimate.values[name]) < 0.3 * a, name


def coverage(simulate: Callable, tx90l: RobotModel, seeds: range) -> tuple[float, float, float]:
    inside, squares, chi2 = [], [], []
    for seed in seeds:
        simulated = simulate(seed, 50)
        fit = calibrate(tx90l, simulated.poses)
        expected = fit.estimate.regrouped(simulated.truth)
        chi2.append(fit.estimate.reduced_chi2)
        for name in fit.identifiability.kept_names:
            low, high = fit.estimate.interval(name)  # type: ignore[misc]
            inside.append(low <= expected[name] <= high)
            squares.append(((fit.estimate.values[name] - expected[name]) / fit.estimate.std(name)) ** 2)
    return float(np.mean(inside)), float(np.mean(squares)), float(np.mean(chi2))


def test_intervals_cover_the_regrouped_truth(simulate: Callable, tx90l: RobotModel) -> None:
    """Truths drawn from the very priors that the fit is told (stiffness: 30 % told, 15 % drawn, so slightly wide)."""
    share, squares, chi2 = coverage(simulate, tx90l, range(100, 112))
    assert 0.9 <= share <= 1.0
    assert 0.5 <= squares <= 1.5
    assert 0.8 <= chi2 <= 1.2


@pytest.mark.slow
def test_intervals_cover_over_many_seeds(simulate: Callable, tx90l: RobotModel) -> None:
    share, squares, chi2 = coverage(simulate, tx90l, range(200, 300))
    assert 0.93 <= share <= 0.99
    assert 0.7 <= squares <= 1.2
    assert 0.95 <= chi2 <= 1.05


def test_verification_beats_the_rigid_fit(simulate: Callable, tx90l: RobotModel) -> None:
    simulated, fresh = simulate(5, 60), simulate(6, 150, truth=simulate(5, 60).truth, noise=False)
    elastic, rigid = calibrate(tx90l, simulated.poses), calibrate(tx90l, simulated.poses, elastic=False)
    seen, bare = verify(elastic.model, fresh.poses), verify(rigid.model, fresh.poses, elastic=False)
    assert seen.all.p90 < 0.07e-3 < 0.5e-3 < bare.all.p90
    standard = np.linalg.norm(seen.errors, axis=1) / seen.std
    assert 0.5 < np.sqrt(np.mean(standard[~seen.ambiguous] ** 2)) < 1.5


def test_any_orientation_of_the_tracker(simulate: Callable, tx90l: RobotModel) -> None:
    simulated = simulate(7, 60)
    turn, shift = vector_rotation(np.array([0.4, -1.0, 2.0])), np.array([3.0, -2.0, 0.5])
    turned = replace(simulated.poses, position=simulated.poses.position @ turn.T + shift)
    straight, moved = calibrate(tx90l, simulated.poses), calibrate(tx90l, turned)
    np.testing.assert_allclose(moved.errors.mean, straight.errors.mean, rtol=5e-3)
    again = predict(tx90l.with_estimate(moved.estimate), turned).position
    np.testing.assert_allclose(again, predict(moved.model, turned).position, atol=1e-9)


def test_a_second_station_gets_its_own_frame(simulate: Callable, tx90l: RobotModel) -> None:
    two = replace(tx90l, stations=("tracker", "window"), station=np.zeros((2, 6)))
    simulated = simulate(8, 80)
    turn, shift = vector_rotation(np.array([0.1, 0.2, -2.0])), np.array([1.0, 2.0, 0.3])
    names, points = simulated.poses.station.copy(), simulated.poses.position.copy()
    names[40:] = "window"
    names = np.array(["tracker"] * 40 + ["window"] * 40)
    points[40:] = points[40:] @ turn.T + shift
    fit = calibrate(two, replace(simulated.poses, station=names, position=points))
    assert (fit.identifiability.rank, len(fit.identifiability.names)) == (35, 53)
    assert fit.errors.max < 0.15e-3


def test_outliers_are_found_and_listed(simulate: Callable, tx90l: RobotModel) -> None:
    """10 % of the points 5 mm off."""
    simulated = simulate(9, 80)
    rng = np.random.default_rng(0)
    wrong = rng.choice(80, 8, replace=False)
    points = simulated.poses.position.copy()
    directions = rng.normal(size=(8, 3))
    points[wrong] += 5e-3 * directions / np.linalg.norm(directions, axis=1)[:, None]
    fit = calibrate(tx90l, replace(simulated.poses, position=points), loss="cauchy")
    assert set(fit.estimate.outliers) == set(wrong.tolist())
    fine = np.delete(np.arange(80), wrong)
    assert ErrorStatistics.of(fit.residuals[fine]).max < 0.15e-3


def test_the_secant_scale_widens_the_drives_alone(simulate: Callable, tx90l: RobotModel) -> None:
    poses = simulate(1).poses
    tight = ElasticPrior.of(tx90l, poses, None)
    wide = ElasticPrior.of(tx90l, poses, None, secant_scale=0.1)
    changed = np.flatnonzero(np.diag(wide.covariance) - np.diag(tight.covariance))
    assert [tight.parameters.names[k] for k in changed] == [f"joint_{i}.drive.stiffness" for i in (1, 2, 3)]


def test_a_stiffer_secant_is_found(simulate: Callable, tx90l: RobotModel) -> None:
    """Drives 8 % softer under gravity than stage 1 (known to 1 %) said: without the scale the fit strains, with it the fit recovers."""
    truth = simulate(11, 80).truth
    simulated = simulate(11, 80)
    drives = [f"joint_{i}.drive.stiffness" for i in (1, 2, 3)]
    tangent = {n: v for n, v in truth.items() if n.endswith("stiffness") or n.startswith("link_")}
    tangent |= {name: truth[name] * 1.08 for name in drives}
    start = tx90l.with_values(tangent)
    precise = replace(start.config, prior=replace(start.config.prior, mass=1e-3, com=1e-4))
    known = replace(start, config=precise)
    from flexcal.estimation import Estimate, Parameter, Parameters

    names = [n for n in truth if n.endswith("stiffness")]
    parameters = Parameters(Parameter(n, "N m/rad", start.value(n), scale="log") for n in names)
    stage_one = Estimate(
        parameters, np.diag([0.01**2] * 9), 9, (), (True,) * 9, 0.0, 0.0, 0, "converged", "", 0
    )
    scaled = calibrate(known, simulated.poses, stiffness=stage_one, secant_scale=0.1)
    plain = calibrate(known, simulated.poses, stiffness=stage_one)
    assert plain.estimate.cost > scaled.estimate.cost + 15
    assert 0.8 < scaled.estimate.reduced_chi2 < 1.2
    for name in drives[1:]:
        assert abs(scaled.estimate.values[name] / truth[name] - 1) < 0.03


def test_poses_that_cannot_work_are_refused(simulate: Callable, tx90l: RobotModel) -> None:
    poses = simulate(1).poses
    with pytest.raises(FlexcalError, match="too few for 29 identifiable parameters"):
        calibrate(tx90l, poses.subset(slice(0, 9)))
    same = replace(poses, q=np.repeat(poses.q[:1], len(poses), axis=0))
    with pytest.raises(FlexcalError, match="all 60 poses are the same"):
        calibrate(tx90l, same)
    still = poses.q.copy()
    still[:, 3] = 0.3
    with pytest.raises(FlexcalError, match="joint_4 never moves"):
        calibrate(tx90l, replace(poses, q=still))
    flank = predict(tx90l, poses).rest.flank
    with pytest.raises(
        FlexcalError, match=r"joint_2 rests on one flank.*cannot be told from the joint's offset"
    ):
        calibrate(tx90l, poses.subset(flank[:, 1] > 0))


def test_the_fit_without_backlash_is_worse(simulate: Callable, tx90l: RobotModel) -> None:
    truth = simulate(12, 80).truth | {"joint_2.backlash": 3e-4, "joint_3.backlash": 3e-4}
    simulated = simulate(12, 80, truth=truth)
    with_, without = (
        calibrate(tx90l, simulated.poses),
        calibrate(tx90l, simulated.poses, terms=("kinematic",)),
    )
    assert with_.estimate.reduced_chi2 < 1.3 < without.estimate.reduced_chi2
    assert abs(with_.estimate.values["joint_2.backlash"] - 3e-4) < 4 * with_.estimate.std("joint_2.backlash")  # type: ignore[operator]


def test_a_nominal_robot_can_be_verified(simulate: Callable, tx90l: RobotModel) -> None:
    """Before any estimate there is no covariance: the flank is judged by the size of the torque alone."""
    simulated = simulate(1)
    seen = verify(tx90l, simulated.poses)
    assert seen.all.mean > 0.2e-3
    assert not seen.std.any()
