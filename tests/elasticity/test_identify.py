"""Stage 1 on analytic responses: exact recovery, truthful intervals, what cannot be identified, delays, searches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from over_seeds import over_seeds

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.identification import MultiStart, PopulationSearch, fit_springs
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResonanceWeighting,
    ResponseModel,
    ResponseResidual,
    Tolerances,
    UniformWeighting,
)
from flexcal.elasticity.time_periodic import DriveTorque, ReferenceMotion, reference_shift
from flexcal.estimation import Parameters
from flexcal.model.robot import Posterior, declared_parameter, spring_names, uncertain_inertials
from flexcal.model.robot.drive_config import PriorConfig

ONE_START = MultiStart(agreement=1)
"""Enough from the declared springs; what a search is for has tests of its own."""

VISCOUS = np.array([1.6, 1.3, 1.8])
"""As in the synthetic responses."""


def perturbed(model, rng, factor=3.0):
    """The robot with every spring multiplied or divided by up to `factor`."""
    return model.with_values(
        {name: model.value(name) * factor ** rng.uniform(-1, 1) for name in spring_names(model)}
    )


@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 1))])
def test_noiseless_recovery_from_far_starts(stiff, poses, synthesise, seed):
    """All 18 parameters to 1e-6 from ×÷3 starts."""
    rng = np.random.default_rng(seed)
    responses = synthesise(stiff, poses["default"][[0, 1, 3]], noise=1e-7, step=8)
    result = fit_springs(
        perturbed(stiff, rng), responses, rng=rng, inertias_known=True, tolerances=Tolerances.none()
    )
    assert result.estimate.converged
    for name in spring_names(stiff):
        assert result.estimate.values[name] == pytest.approx(stiff.value(name), rel=1e-6), name


def test_delays_are_recovered(stiff, poses, synthesise, drawn, rng):
    truth = drawn(stiff, rng, inertias=False)
    responses = synthesise(truth, poses["default"][:3], noise=1e-3, rng=rng, step=8)
    estimate = fit_springs(
        stiff, responses, rng=rng, inertias_known=True, tolerances=Tolerances.none()
    ).estimate
    for joint in ("joint_1", "joint_2", "joint_3"):
        std = estimate.std(f"{joint}.delay")
        assert std is not None
        assert std < 5e-6
        assert abs(estimate.values[f"{joint}.delay"] - truth.value(f"{joint}.delay")) < 4 * std


def test_paper_plan_leaves_the_forearm_torsion_unidentified(tx90l, poses, synthesise, drawn, rng):
    """Without a payload off the axis, bearing_y of joint_3 does not show; with the default plan everything stiff does."""
    truth = drawn(tx90l, rng, inertias=True)
    hidden = "joint_3.bearing_y.stiffness"
    paper = fit_springs(
        tx90l,
        synthesise(truth, poses["paper"], noise=0.1, rng=rng, payload=0.0, step=8),
        rng=rng,
        search=ONE_START,
    )
    quantity = paper.quantity(hidden, truth.value(hidden))
    assert quantity["identifiable"] is False
    assert quantity["std"] is None
    assert paper.quantity("joint_1.drive.stiffness")["identifiable"]
    default = fit_springs(
        tx90l,
        synthesise(truth, poses["default"][[0, 1, 3]], noise=0.05, rng=rng, step=8),
        rng=rng,
        search=ONE_START,
        tolerances=Tolerances(inertia=False),  # tensors are exact here
    )
    assert all(default.quantity(n)["identifiable"] for n in spring_names(tx90l) if n.endswith(".stiffness"))


def test_inertials_known_from_before_count_as_known(tx90l, poses, synthesise, drawn, rng):
    """With a joint posterior of vanishing width the fit is that with known inertias, interval by interval."""
    truth = drawn(tx90l, rng, inertias=True)
    responses = synthesise(truth, poses["default"][:2], noise=0.05, rng=rng, payload=0.0, step=16)
    names = uncertain_inertials(tx90l, range(6))
    known = tx90l.with_values({name: truth.value(name) for name in names})
    items = Parameters(declared_parameter(known, name) for name in names)
    width = np.diag((1e-4 * items.prior_std()) ** 2)
    informed = replace(known, posterior=Posterior(items, width))
    springs = [f"joint_{i}.{spring}.stiffness" for i in (1, 2, 3) for spring in ("drive", "bearing_x")]

    def fitted(robot, inertias_known):
        estimate = fit_springs(
            robot,
            responses,
            rng=np.random.default_rng(1),
            inertias_known=inertias_known,
            tolerances=Tolerances.none(),
            search=ONE_START,
        ).estimate
        x, covariance = estimate.marginal(springs)
        return x, np.sqrt(np.diag(covariance))

    (one, one_std), (other, other_std) = fitted(informed, False), fitted(known, True)
    assert np.abs(one - other).max() < 0.02 * other_std.min()
    np.testing.assert_allclose(one_std, other_std, rtol=0.1)


def test_population_search_reaches_the_same_fit(stiff, poses, synthesise, drawn, rng):
    truth = drawn(stiff, rng, inertias=False)
    responses = synthesise(truth, poses["default"][:1], noise=1e-2, rng=rng, step=12)
    common = {"inertias_known": True, "tolerances": Tolerances.none()}
    one = fit_springs(stiff, responses, rng=rng, search=MultiStart(), **common)
    search = PopulationSearch(factor=1.6, population=54, generations=25)
    other = fit_springs(stiff, responses, rng=rng, search=search, **common)
    assert other.estimate.cost == pytest.approx(one.estimate.cost, rel=1e-3)


def test_result_describes_the_fit(stiff, poses, synthesise, drawn, rng):
    truth = drawn(stiff, rng, inertias=False)
    responses = synthesise(truth, poses["default"][:2], noise=1e-2, rng=rng, step=8)
    seen = []
    result = fit_springs(
        stiff, responses, rng=rng, inertias_known=True, tolerances=Tolerances.none(),
        progress=lambda what, share: seen.append((what, share)),
    )  # fmt: skip
    assert result.predicted[0].shape == responses[0].response.shape
    assert result.misfit.shape == (2, 3, 3)
    assert 0.5 < result.misfit.mean() < 1.5
    for stage in ("searching", "fitting"):
        shares = [share for what, share in seen if what == stage]
        assert shares[0] == 0.0 and shares[-1] == 1.0 and shares == sorted(shares)


def test_reference_motion_is_part_of_the_model(stiff, poses, synthesise, rng):
    """Responses under the reference motion: with the plan the damping is right, without it a bearing's is far too large."""
    controller = stiff.controller
    lines = np.arange(13, 320, 8)
    plan = MultisinePlan(
        name="test", poses=poses["default"], joints=(0, 1, 2), base_frequency_hz=0.25, lines=lines,
        amplitude=np.full((3, len(lines)), 3.0), periods=4, settle_periods=2, realisations=4, signs=True,
        reference_amplitude=np.deg2rad(1.5), reference_frequency_hz=2.125, kp=controller.kp, kd=controller.kd,
        rate_hz=4000.0, torque="held", seed=0,
    )  # fmt: skip
    motion = ReferenceMotion.of(plan)
    moving = []
    for k, response in enumerate(synthesise(stiff, poses["default"], noise=3e-3, rng=rng, step=8)):
        robot = replace(
            stiff,
            drives=replace(
                stiff.drives, viscous=stiff.drives.viscous * np.append(VISCOUS, np.ones(3)) * (1 + 0.03 * k)
            ),
        )
        shift = reference_shift(robot, response.q_mean, None, response.frequencies_hz, motion)
        moving.append(replace(response, response=response.response + shift))
    name = "joint_2.bearing_y.damping"
    fits = [
        fit_springs(
            stiff,
            moving,
            rng=rng,
            inertias_known=True,
            plan=plan,
            tolerances=Tolerances.none(),
            search=ONE_START,
        ).estimate
        for plan in (plan, None)
    ]
    std = fits[0].std(name)
    assert std is not None
    assert abs(fits[0].values[name] - stiff.value(name)) < 3 * std
    assert abs(fits[1].values[name] - stiff.value(name)) > 3 * std


@pytest.mark.parametrize("weighting", [UniformWeighting(), ResonanceWeighting()])
def test_other_weightings_find_the_springs_too(stiff, poses, synthesise, drawn, rng, weighting):
    truth = drawn(stiff, rng, inertias=False)
    responses = synthesise(truth, poses["default"][:3], noise=1e-3, rng=rng, step=8)
    result = fit_springs(
        stiff, responses, rng=rng, inertias_known=True, tolerances=Tolerances.none(), weighting=weighting
    )
    for name in spring_names(stiff)[:9]:
        assert result.estimate.values[name] == pytest.approx(truth.value(name), rel=0.02), name


def squared_errors(model, poses, synthesise, drawn, seeds, *, inertias):
    """z (seeds, 18) of the springs, and their standard deviations over the Cramér-Rao bound."""
    z, ratio = zip(*over_seeds(errors_of_one, seeds, model, poses, synthesise, drawn, inertias), strict=True)
    return np.array(z), np.array(ratio)


def errors_of_one(seed, model, poses, synthesise, drawn, inertias):
    """The same of one robot."""
    names = spring_names(model)
    rng = np.random.default_rng(seed)
    truth = drawn(model, rng, inertias=inertias)
    responses = synthesise(truth, poses, noise=0.03, rng=rng, step=12)
    estimate = fit_springs(
        model, responses, rng=rng, inertias_known=not inertias, tolerances=Tolerances.none(),
        search=ONE_START,
    ).estimate  # fmt: skip
    index = [estimate.parameters.index(name) for name in names]
    std = np.sqrt(np.diag(estimate.covariance))[index]
    error = [np.log(estimate.values[name] / truth.value(name)) for name in names]
    known = np.array(estimate.identifiable)[index]
    bound = cramer_rao(model, truth, responses, estimate.parameters)[index]
    return np.where(known, np.array(error) / std, np.nan), std / bound


def cramer_rao(model, truth, responses, parameters):
    """Standard deviations (p,) that the information at the truth and the priors allow."""
    residual = ResponseResidual.of(
        ResponseModel.of(model, responses, parameters), responses, CovarianceWeighting()
    )
    values = {name: truth.values[name] for name in parameters.names if name in truth.values}
    jacobian = residual.linearise(parameters.coordinates(values))[1]
    information = jacobian.T @ jacobian + parameters.prior_information()
    return np.sqrt(np.diag(np.linalg.solve(information, np.eye(len(information)))))


def check_intervals(z, ratio):
    inside = np.abs(z[np.isfinite(z)]) < 1.96
    assert 0.90 <= inside.mean() <= 0.99
    assert 0.6 <= np.nanmean(z**2) <= 1.6
    assert np.median(ratio) <= 1.5


def test_intervals_of_one_robot_are_of_the_size_of_errors(stiff, poses, synthesise, drawn):
    z, ratio = errors_of_one(0, stiff, poses["default"][[0, 1, 3]], synthesise, drawn, inertias=False)
    assert 0.4 <= np.nanmean(z**2) <= 2.0 and np.median(ratio) <= 1.5


@pytest.mark.slow
def test_intervals_are_true(stiff, poses, synthesise, drawn):
    check_intervals(
        *squared_errors(stiff, poses["default"][[0, 1, 3]], synthesise, drawn, range(12), inertias=False)
    )


@pytest.mark.slow
def test_intervals_are_true_with_inertias_as_wrong_as_cad(stiff, poses, synthesise, drawn):
    check_intervals(*squared_errors(stiff, poses["default"], synthesise, drawn, range(40), inertias=True))


def test_half_gap_is_found(tx90l, poses, synthesise, rng):
    """Drives that are softer the longer their gap stands open do not pull the stiffness down, and show the half gap."""
    lines = np.arange(13, 320, 8)
    plan = MultisinePlan(
        name="test", poses=poses["default"], joints=(0, 1, 2), base_frequency_hz=0.25, lines=lines,
        amplitude=np.full((3, len(lines)), 8.0), periods=4, settle_periods=2, realisations=4, signs=True,
        reference_amplitude=0.0, reference_frequency_hz=2.125, kp=tx90l.controller.kp, kd=tx90l.controller.kd, rate_hz=4000.0,
        torque="held", seed=0,
    )  # fmt: skip
    half_gap, responses = {1: 4e-5, 2: 6e-5}, []
    dragging = replace(
        tx90l, drives=replace(tx90l.drives, viscous=tx90l.drives.viscous * np.append(VISCOUS, np.ones(3)))
    )
    for q in poses["default"]:
        added = DriveTorque.of(dragging, q, None, plan).backlash_compliance()[0]
        soft = {
            f"joint_{axis + 1}.drive.{key}": 1 / (1 + size * added[axis])
            for axis, size in half_gap.items()
            for key in ("stiffness", "damping")
        }
        softer = tx90l.with_values({name: factor * tx90l.value(name) for name, factor in soft.items()})
        response = synthesise(softer, q[None], noise=0.01, rng=rng, step=8)[0]
        responses.append(replace(response, pose=len(responses)))
    estimate = fit_springs(
        tx90l, responses, rng=rng, inertias_known=True, tolerances=Tolerances.none(), plan=plan
    ).estimate
    for name in ("joint_2.drive.stiffness", "joint_3.drive.stiffness"):
        low, high = estimate.interval(name) or (0.0, 0.0)
        assert low < tx90l.value(name) < high
    index = estimate.parameters.index("joint_3.drive.half_gap")
    std = np.sqrt(estimate.covariance[index, index])
    assert std < 1.5e-5
    assert estimate.values["joint_3.drive.half_gap"] == pytest.approx(half_gap[2], abs=3 * std)


def test_masses_that_take_up_a_misfit_have_no_intervals(stiff, synthesise, shaken, poses, rng):
    """A resonance that the model lacks moves masses by more than is known of them; without it none moves so far."""
    clean = synthesise(stiff, poses["default"][:2], noise=0.003, rng=rng, step=16)
    calm = fit_springs(stiff, clean, rng=rng, search=ONE_START).estimate
    moved = fit_springs(stiff, [shaken(r, 0.3) for r in clean], rng=rng, search=ONE_START).estimate
    assert calm.misfit is None and calm.std("link_3.mass") is not None
    assert moved.misfit is not None and moved.misfit.inertials > 1.3
    assert moved.std("link_3.mass") is None and moved.covariance[moved.parameters.index("link_3.mass")].any()


@pytest.mark.statistical
def test_torque_constants_are_in_the_intervals(stiff, synthesise, poses, rng):
    """Believed torques of all motors 2 % too small: the springs of a robot whose inertias follow are as wrong, and say so.

    The prior is of every motor by itself, so that one error common to n of them counts √n times: with the default of 5 % it is a usual one.
    """
    responses = [
        replace(r, response=r.response * 1.02)
        for r in synthesise(stiff, poses["default"][:2], noise=0.003, rng=rng, step=16)
    ]
    names = [f"joint_{j}.drive.stiffness" for j in (1, 2, 3)]
    squares = []
    for std in (0.0, PriorConfig().torque_constant):
        prior = replace(stiff.config.prior, torque_constant=std)
        robot = replace(stiff, config=replace(stiff.config, prior=prior))
        estimate = fit_springs(robot, responses, rng=rng, search=ONE_START).estimate
        errors = np.array([np.log(estimate.values[name] / stiff.value(name)) for name in names])
        numbers = [estimate.parameters.index(name) for name in names]
        squares.append(np.mean(errors**2 / np.diag(estimate.covariance)[numbers]))
    assert squares[1] < 1.5 < squares[0]
