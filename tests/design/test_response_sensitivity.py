"""Sensitivities of frequency responses against finite differences, full covariances and a small Monte Carlo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.design.frequency import (
    COMMON_SENSORS,
    PlannedResponses,
    Schedule,
    flat_multisine,
    largest_stiffness_std,
)
from flexcal.design.frequency.response_jacobian import (
    friction_disturbance,
    pose_response,
    response_parameters,
    thinned,
)
from flexcal.design.frequency.response_noise import FrictionDisturbance, equation_error
from flexcal.model.robot import FRICTION_LOG_STD, ArmSensor
from flexcal.model.robot.measuring_config import ArmSensorConfig
from flexcal.model.vibration import linearise, transfer_matrix

POSES = np.radians(
    [[0, 60.1, -105, 79.6, 67.5, 0], [0, -50.6, -73.8, 137.8, 50.7, 0], [0, 56, -8, -100, 41, 30]]
)


@pytest.fixture(scope="module")
def plan(tx90l):
    return thinned(
        flat_multisine(tx90l, POSES, name="test", payload=None, reference=np.radians(1.5), seed=3), 4
    )


@pytest.fixture(scope="module")
def planned(tx90l, plan):
    return PlannedResponses.of(tx90l, plan)


def test_derivatives_are_those_of_finite_differences(tx90l, plan, planned):
    """Of the transfer matrix with friction's viscous coefficients, along a spring, a mass, a delay and a geometric error."""
    q, frequencies = POSES[0], plan.frequencies_hz
    friction = FrictionDisturbance.of(tx90l, linearise(tx90l, q), plan)
    viscous = tx90l.drives.viscous[:3] + friction.viscous
    rubbing = {f"joint_{k + 1}.viscous": v for k, v in enumerate(viscous)}

    def response(changes):
        late = changes.pop("joint_2.delay", 0.0)
        robot = tx90l.with_values(rubbing | changes)
        moved = transfer_matrix(linearise(robot, q), frequencies).response
        moved[:, :, 1] *= np.exp(-2j * np.pi * frequencies * late)[:, None]
        return moved

    found, names = planned.responses[0], planned.parameters.names
    np.testing.assert_allclose(found.response, response({}))
    for name in (
        "joint_2.bearing_x.stiffness",
        "link_3.mass",
        "link_2.com_x",
        "payload.mass",
        "joint_2.delay",
    ):
        item = planned.parameters[name]
        step = 1e-4 * item.prior_std if name.endswith(("delay", "com_x")) else 1e-5
        ends = [response({name: item.natural(item.coordinate(item.value) + side * step)}) if item.scale == "log"
                else response({name: item.value + side * step}) for side in (1, -1)]  # fmt: skip
        expected = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(
            found.derivatives[..., names.index(name)], expected, rtol=1e-4, atol=2e-5 * np.abs(expected).max()
        )
    up, down = (response({"joint_3.viscous": viscous[2] * np.exp(side * 1e-5)}) for side in (1, -1))
    expected = FRICTION_LOG_STD * (up - down) / 2e-5
    np.testing.assert_allclose(
        found.nuisance[..., 2], expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max()
    )


def test_eliminating_the_nuisances_leaves_the_same_covariance(planned, plan):
    """The Schur complement against the shared block of the inverse of everything, nuisances of all poses included."""
    shared, own = len(planned.parameters), planned.responses[0].nuisance.shape[-1]
    size = shared + own * len(POSES)
    everything = np.zeros((size, size))
    everything[:shared, :shared] = planned.prior_information
    for k, response in enumerate(planned.responses):
        rows = response.whitened(plan)
        at = np.r_[shared + k * own : shared + (k + 1) * own, :shared]
        everything[np.ix_(at, at)] += rows.T @ rows
        everything[np.ix_(at[:own], at[:own])] += np.eye(own)
    scale = 1 / np.sqrt(np.diag(everything))
    covariance = np.linalg.inv(everything * np.outer(scale, scale)) * np.outer(scale, scale)
    np.testing.assert_allclose(
        np.sqrt(np.diag(planned.sensitivity.covariance())), np.sqrt(np.diag(covariance))[:shared], rtol=1e-6
    )


def test_predicted_std_is_the_scatter_of_fits_to_noisy_responses(tx90l, planned, plan, rng):
    """G with noise drawn as sensors and friction make it: phasors Y = G Γ + N per experiment, fitted by weighted least squares."""
    springs, draws = 18, 400
    fits = np.zeros((draws, springs))
    information = np.zeros((springs, springs))
    for response in planned.responses:
        error = equation_error(plan, response.response, response.friction, COMMON_SENSORS)
        change = response.derivatives[..., :springs]
        root = np.linalg.cholesky(error)
        lines, axes = response.response.shape[:2]
        inverse = np.linalg.inv(root)
        turn = np.exp(2j * np.pi / axes * np.outer(range(axes), range(axes))) / np.sqrt(axes)
        gamma = plan.amplitude.T[:, :, None] * turn
        unit = rng.standard_normal((2, draws, lines, axes, axes))
        noise = root @ ((unit[0] + 1j * unit[1]) / np.sqrt(2)) @ np.linalg.inv(gamma)
        white = np.einsum("lij,ljkc->likc", inverse, change) * plan.amplitude.T[:, None, :, None]
        seen = np.einsum("lij,dljk->dlik", inverse, noise) * plan.amplitude.T[:, None, :]
        information += 2 * np.real(np.einsum("likc,likd->cd", white.conj(), white))
        fits += 2 * np.real(np.einsum("likc,dlik->dc", white.conj(), seen))
    scatter = np.std(np.linalg.solve(information, fits.T).T, axis=0)
    bare = replace(
        planned,
        parameters=planned.parameters.subset(planned.parameters.names[:springs]),
        prior_information=np.zeros((springs, springs)),
        responses=tuple(
            replace(r, derivatives=r.derivatives[..., :springs], nuisance=r.nuisance[..., :0])
            for r in planned.responses
        ),
    )
    np.testing.assert_allclose(scatter, list(bare.std().values()), rtol=0.15)


def test_friction_under_a_fast_reference_is_that_of_two_pulses(tx90l, plan):
    """For v much slower than the reference, Bussgang: the mean of the delta function 2 F δ(V) over a cycle, 2 F / (π V)."""
    found = FrictionDisturbance.of(tx90l, linearise(tx90l, POSES[0]), plan)
    speed = plan.reference_amplitude * 2 * np.pi * plan.reference_frequency_hz
    np.testing.assert_allclose(found.viscous, 2 * tx90l.drives.coulomb[:3] / (np.pi * speed), rtol=0.15)
    still = FrictionDisturbance.of(
        tx90l.with_values({f"joint_{k}.coulomb": 0.0 for k in (1, 2, 3)}), linearise(tx90l, POSES[0]), plan
    )
    assert not still.power.any() and not still.viscous.any()


def test_encoder_noise_of_one_phasor(tx90l, plan, rng):
    """White noise of N samples averaged over periods, signs and realisations has phasors of the variance 4 σ²/N."""
    samples = 512
    short = replace(
        plan, base_frequency_hz=2.0, rate_hz=1024.0, lines=np.array([7]), amplitude=np.ones((3, 1))
    )
    noise = rng.standard_normal((4000, samples))
    phasors = np.fft.rfft(noise, axis=1)[:, 7] * 2 / samples
    expected = np.mean(np.abs(phasors) ** 2) / (2 * 2 * short.realisations)
    system = linearise(tx90l, POSES[0])
    free = FrictionDisturbance(np.zeros(3), np.zeros((1, 3)))
    response = transfer_matrix(system, short.frequencies_hz).response
    quiet = replace(COMMON_SENSORS, torque_noise=0.0, resolution=np.sqrt(12.0))
    error = equation_error(short, response, free, quiet)[0, 0, 0].real
    assert error == pytest.approx(expected * (2 * np.pi * 14.0) ** 4, rel=0.05)


def test_more_realisations_reach_a_wanted_std_or_it_is_said_what_is_reached(planned):
    now = largest_stiffness_std(planned.sensitivity)[1]
    better = planned.reaching(0.85 * now)
    assert largest_stiffness_std(better.sensitivity)[1] <= 0.85 * now
    assert better.plan.realisations > planned.plan.realisations
    shorter = planned.reaching(1.1 * now)
    assert shorter.plan.recordings_per_pose * shorter.plan.duration < 384
    with refused("E-DESIGN-010", "0.001", "24"):
        planned.reaching(1e-5)


def test_the_plan_must_excite_the_elastic_joints(tx90l, plan):
    friction = friction_disturbance(tx90l, POSES[0], plan)
    other = replace(plan, joints=(0, 1), amplitude=plan.amplitude[:2])
    with refused("E-DESIGN-011"):
        pose_response(tx90l, POSES[0], other, response_parameters(tx90l, plan), friction)


def test_a_schedule_of_the_robots_without_effort_is_refused(tx90l):
    joints = (replace(tx90l.joints[0], effort=0.0), *tx90l.joints[1:])
    with refused("E-DESIGN-006", "joint_1"):
        flat_multisine(
            replace(tx90l, joints=joints),
            POSES,
            name="x",
            payload=None,
            reference=0.02,
            seed=0,
            schedule=Schedule(),
        )


def test_a_sensor_on_the_arm_counts(tx90l, plan):
    """Its rows are derived as finite differences of the reading have it, and a forearm that motors do not see becomes known."""
    config = ArmSensorConfig(frame="flange", xyz=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0))
    place, along = np.array([0.03, 0.12, 0.05]), np.array([1.0, 0.0, 0.0])
    sensor = ArmSensor("forearm", 3, place, along, True, 2, config)
    sensing = replace(tx90l, sensors={"forearm": sensor})
    empty = replace(plan, payload=0.0, poses=POSES[:2])
    name = "joint_3.bearing_y.stiffness"
    assert PlannedResponses.of(tx90l, empty).std()[name] > 0.5
    planned = PlannedResponses.of(sensing, empty)
    assert planned.std()[name] < 0.05
    found, names = planned.responses[0], planned.parameters.names
    assert found.response.shape[1:] == (4, 3)
    rubbing = {
        f"joint_{k + 1}.viscous": v for k, v in enumerate(tx90l.drives.viscous[:3] + found.friction.viscous)
    }

    def reading(xyz, direction):
        moved = replace(sensor, xyz=xyz, direction=direction)
        system = linearise(tx90l.with_values(rubbing), POSES[0], 0.0, sensors=[moved])
        return transfer_matrix(system, plan.frequencies_hz).response[:, 3]

    step = np.array([0.0, 1e-4, 0.0])
    expected = (reading(place + step, along) - reading(place - step, along)) / 2e-4
    column = found.derivatives[:, 3, :, names.index("sensor.forearm.position_y")]
    np.testing.assert_allclose(column, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())
    own = found.derivatives[:, 3, :, names.index("sensor.forearm.sensitivity")]
    np.testing.assert_allclose(own, reading(place, along), rtol=1e-9)
    noise = found.error(empty)[:, 3, 3].real
    kept = 2 * (empty.periods - empty.settle_periods) * empty.realisations
    samples = kept * empty.rate_hz / empty.base_frequency_hz
    assert noise.min() >= 4 / samples * 0.02**2
