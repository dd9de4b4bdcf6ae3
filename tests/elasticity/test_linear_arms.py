"""Stage 1 on linear arms of a simulator that shares no code: the paper's weights, uniform ones, and torque constants that are off."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from linear_arm import Arm
from over_seeds import over_seeds

from flexcal import RobotModel, identify_stiffness
from flexcal.elasticity.identification import MultiStart, fit_springs
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResonanceWeighting,
    Tolerances,
    UniformWeighting,
    Weighting,
)
from flexcal.estimation import Estimate
from flexcal.frequency.periodic import FrequencyResponse, reciprocity
from flexcal.jobs.experiments import frequency_plan
from flexcal.jobs.stiffness import StiffnessIdentification
from flexcal.model.vibration import linearise, transfer_matrix
from flexcal.report.checks import response_checks

ROBOT = Path(__file__).resolve().parents[2] / "examples" / "tx90l" / "robot.yaml"
ONE_START = MultiStart(agreement=1)
LINES = np.arange(13, 320, 12) * 0.25


def poses(plan: str) -> np.ndarray:
    """Poses (P, 6) rad of a plan of the example."""
    with (ROBOT.parent / "frequency_poses.csv").open() as file:
        return np.deg2rad(
            [[float(r[f"q{i}_deg"]) for i in range(1, 7)] for r in csv.DictReader(file) if r["plan"] == plan]
        )


def declared(torque_constant: float | None = None) -> RobotModel:
    """The robot as its files describe it, without backlash."""
    model = RobotModel.from_yaml(ROBOT, estimates=False)
    prior = model.config.prior
    if torque_constant is not None:
        prior = replace(prior, torque_constant=torque_constant)
    geometry = replace(model.config.geometry, backlash=())
    return replace(model, config=replace(model.config, prior=prior, geometry=geometry))


def test_the_simulator_and_the_model_are_one_robot() -> None:
    q, held = np.deg2rad([10, -28.6, -94.3, 37.3, -98.1, 20]), 0.0
    frequencies = np.array([3.0, 11.0, 20.0, 40.0, 70.0])
    arm, model = Arm.read(ROBOT), declared()
    for payload in (None, held):
        one = arm.response(q, frequencies, arm.viscous, payload)
        other = transfer_matrix(linearise(model, q, payload), frequencies).response
        np.testing.assert_allclose(one, other, rtol=1e-6)


def normalised(arm: Arm, estimate: Estimate) -> list[float]:
    """Errors over standard deviations of what counts as known."""
    found = []
    for name, value in arm.truth().items():
        number = estimate.parameters.index(name)
        if estimate.identifiable[number]:
            std = np.sqrt(estimate.covariance[number, number])
            found.append(float(np.log(estimate.values[name] / value) / std))
    return found


def deviations(seed: int, weighting: Weighting, plan: str, gain: float) -> tuple[list[float], bool]:
    """Errors over standard deviations of what counts as known of one arm, and whether the responses count as explained."""
    rng = np.random.default_rng(seed)
    arm = Arm.read(ROBOT).drawn(rng, gain=gain)
    responses = arm.measured(poses(plan), rng, empty=plan == "paper", frequencies_hz=LINES)
    estimate = fit_springs(
        declared(gain),
        responses,
        rng=rng,
        weighting=weighting,
        tolerances=Tolerances.none(),
        search=ONE_START,
    ).estimate
    return normalised(arm, estimate), estimate.misfit is None


def check_coverage(found: list[tuple[list[float], bool]], least: float, most: float) -> None:
    z = np.concatenate([own for own, _ in found])
    assert np.mean([explained for _, explained in found]) >= 0.9
    assert least <= np.mean(np.abs(z) < 1.96) <= most
    assert len(z) >= 10 * len(found)


def test_a_cost_without_a_covariance_has_one() -> None:
    """Springs of one arm are known by equal weights, and their errors are as said."""
    check_coverage([deviations(300, UniformWeighting(), "default", 0.0)], 0.85, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("weighting", "plan"),
    [
        (ResonanceWeighting(), "default"),
        (UniformWeighting(), "default"),
        (UniformWeighting(), "paper"),
        pytest.param(
            ResonanceWeighting(),
            "paper",
            marks=pytest.mark.xfail(
                reason="without a payload these weights determine 8 values an arm, not 10"
            ),
        ),
    ],
)
def test_intervals_of_costs_without_a_covariance(weighting: Weighting, plan: str) -> None:
    found = over_seeds(deviations, range(300, 320), weighting, plan, 0.0)
    check_coverage(found, 0.92, 0.98)


@pytest.mark.slow
def test_intervals_with_torque_constants_that_are_off() -> None:
    check_coverage(
        over_seeds(deviations, range(500, 520), CovarianceWeighting(), "default", 0.05), 0.92, 0.98
    )


def deviations_by_tensors(seed: int, known: bool) -> tuple[list[float], bool]:
    """As `deviations`, of an arm whose inertia tensors are off by 15 %, and of which that is `known` of them or nothing."""
    rng = np.random.default_rng(seed)
    arm = Arm.read(ROBOT).drawn(rng, tensor=0.15)
    responses = arm.measured(poses("default"), rng, noise=0.02, frequencies_hz=LINES)
    tolerances = replace(Tolerances.none(), inertia=known)
    estimate = fit_springs(
        declared(0.0), responses, rng=rng, tolerances=tolerances, search=ONE_START
    ).estimate
    return normalised(arm, estimate), estimate.misfit is None


@pytest.mark.slow
@pytest.mark.xfail(
    reason="intervals cover 89 %: tensors are marginalised to first order, and shift resonances by their width"
)
def test_intervals_with_inertia_tensors_that_are_off() -> None:
    check_coverage(over_seeds(deviations_by_tensors, range(700, 720), True), 0.92, 0.99)


@pytest.mark.slow
def test_uncertain_tensors_widen_intervals_that_hold_too_rarely_without() -> None:
    with_prior, without = (
        np.concatenate([own for own, _ in over_seeds(deviations_by_tensors, range(700, 710), known)])
        for known in (True, False)
    )
    assert np.mean(np.abs(without) < 1.96) < 0.8 < 0.85 < np.mean(np.abs(with_prior) < 1.96)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [102, 303])
def test_the_papers_cost_ends_where_the_default_does(seed: int) -> None:
    """On the paper's own plan, whose cost has other minima: no stiffness that is known lies a factor away."""
    rng = np.random.default_rng(seed)
    arm = Arm.read(ROBOT).drawn(rng)
    responses = arm.measured(poses("paper"), rng, empty=True, frequencies_hz=LINES)
    estimate = identify_stiffness(declared(), responses, weighting=ResonanceWeighting(), seed=seed).estimate
    known = {n: v for n, v in arm.truth().items() if n.endswith(".stiffness") and estimate.std(n) is not None}
    assert len(known) >= 5
    for name, value in known.items():
        assert abs(np.log(estimate.values[name] / value)) < 3.5 * estimate.std(name) / estimate.values[name]


@pytest.fixture(scope="module")
def wrong_constants() -> tuple[Arm, list[FrequencyResponse], StiffnessIdentification]:
    """An arm whose torque constants are −6, 4 and 11 % off, its responses, and what stage 1 makes of them."""
    rng = np.random.default_rng(204)
    arm = Arm.read(ROBOT).drawn(rng, gain=0.05)
    responses = arm.measured(poses("default")[[0, 1, 3]], rng, frequencies_hz=LINES)
    model = declared()
    plan = frequency_plan(model, ROBOT.parent / "frequency_poses.csv", "default", seed=0)
    plan = replace(plan, reference_amplitude=0.0, poses=plan.poses[[0, 1, 3]])
    return arm, responses, identify_stiffness(model, responses, plan=plan, search=ONE_START)


def test_torque_constants_are_estimated_and_named(
    wrong_constants: tuple[Arm, list[FrequencyResponse], StiffnessIdentification],
) -> None:
    arm, _, found = wrong_constants
    estimate = found.estimate
    assert estimate.misfit is None
    assert not any(name.endswith(".hardening") for name in estimate.parameters.names)
    for joint, gain in zip(arm.joints, arm.gain, strict=False):
        name = f"{joint}.drive_gain"
        std = estimate.std(name)
        assert std is not None and std < 0.03
        assert abs(estimate.values[name] - gain) < 3 * std
    remark = next(text for text in found.remarks if "torque constants" in text)
    assert "joint_3" in remark
    for name, value in arm.truth().items():
        if name.endswith("drive.stiffness"):
            low, high = estimate.interval(name) or (0.0, 0.0)
            assert 0.97 * low < value < 1.03 * high


def test_reciprocity_and_stage_one_agree_on_torque_constants(
    wrong_constants: tuple[Arm, list[FrequencyResponse], StiffnessIdentification],
) -> None:
    arm, responses, found = wrong_constants
    pairs = reciprocity(responses)
    for pair in pairs:
        first, second = (arm.joints.index(joint) for joint in pair.joints)
        assert abs(pair.gain_ratio - arm.gain[second] / arm.gain[first]) < 4 * pair.gain_ratio_std
        assert pair.corrected_ratio < 1.35
        values = found.estimate.values
        ratio = values[f"{pair.joints[1]}.drive_gain"] / values[f"{pair.joints[0]}.drive_gain"]
        assert abs(pair.gain_ratio - ratio) < 3 * pair.gain_ratio_std
    entry = {"relative_std": 0.05, "relative_noise_std": 0.05, "pose": 1, "degrees_of_freedom": 45.0}
    results = {"reciprocity": [vars(pair) for pair in pairs], "responses": [entry]}
    check = response_checks(results, responses)[0]
    assert check.status == "care" and "torque constants" in check.answer
