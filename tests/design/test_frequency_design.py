"""Poses and amplitudes of frequency experiments: limits, choice and bad input."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from refusals import refused

from flexcal.design.frequency import (
    PlannedResponses,
    choose_frequency_poses,
    flat_multisine,
    optimal_amplitudes,
    payload_placements,
    static_amplitude_share,
    stiffness_curve,
    within_preload,
)
from flexcal.design.frequency.amplitude_spectrum import MOST, ROOM
from flexcal.design.frequency.backlash_limit import CREST, amplitude_share, backlash_load
from flexcal.design.frequency.candidates import FrequencyPoseCandidates
from flexcal.design.frequency.multisines import DROOP, EXCITATION
from flexcal.design.frequency.response_jacobian import thinned
from flexcal.design.frequency.spring_precision import spring_criterion
from flexcal.design.optimality import exchange
from flexcal.design.scene import CollisionChecker
from flexcal.frequency.periodic import (
    crest_factor,
    excitation_torque,
    leave_out_detection_lines,
    multisine_spectra,
    synthesise,
)
from flexcal.model.kinematics import joint_ranges
from flexcal.model.statics import gravity_torque
from flexcal.model.vibration import closed_loop_motion, drive_stretch, linearise


@pytest.fixture(scope="module")
def plan(tx90l):
    anywhere = np.zeros((1, 6))
    flat = flat_multisine(tx90l, anywhere, name="test", payload=None, reference=np.radians(1.5), seed=3)
    return thinned(leave_out_detection_lines(flat), 4)


@pytest.fixture(scope="module")
def choice(tx90l, plan):
    return choose_frequency_poses(tx90l, plan, 4, 14, np.random.default_rng(2))


@pytest.fixture(scope="module")
def amplitudes(tx90l, plan, choice):
    flat = PlannedResponses.of(tx90l, within_preload(tx90l, replace(plan, poses=choice.poses)))
    return flat, optimal_amplitudes(tx90l, flat)


def test_candidates_have_room_and_touch_nothing_and_are_preloaded(tx90l, plan, choice):
    q = choice.candidates
    lower, upper = joint_ranges(tx90l)
    free = np.r_[np.full(3, plan.reference_amplitude + DROOP), np.zeros(3)]
    assert (q >= lower + free).all() and (q <= upper - free).all()
    swing = np.r_[np.full(3, plan.reference_amplitude), np.zeros(3)]
    for side in (-1, 0, 1):
        assert not CollisionChecker(tx90l).collides(q + side * swing).any()
    for pose in q:
        one = replace(plan, poses=pose[None])
        assert static_amplitude_share(tx90l, one) >= 1 - 1e-9
        assert amplitude_share(backlash_load(tx90l, pose, plan), plan.amplitude) >= 1


def test_the_limit_of_a_gap_is_gravity_over_its_crest(tx90l, plan):
    """Without reference motion three standard deviations of the drive's torque, from a time series, meet gravity."""
    q = np.radians([0, 60.1, -105, 79.6, 67.5, 0])
    still = replace(plan, reference_amplitude=0.0, poses=q[None])
    allowed = amplitude_share(backlash_load(tx90l, q, still), still.amplitude)
    system = linearise(tx90l, q)
    moved = closed_loop_motion(system, still.frequencies_hz, still.kp[:3], still.kd[:3])
    strain = (
        tx90l.springs.stiffness[:3, 2][:, None]
        * (drive_stretch(tx90l, system).T @ moved)
        @ multisine_spectra(still, 0)
    )
    torque = synthesise(strain, still.lines, 4096)  # (samples, drives, experiments)
    held = np.abs(gravity_torque(tx90l, q[None]))[0, 1:3]
    rms = np.sqrt(np.mean(torque**2, axis=(0, 2)))[1:]
    assert allowed == pytest.approx((held / (CREST * rms)).min(), rel=0.02)


def test_exchange_finds_the_best_of_all_sets_of_a_small_pool(choice):
    criterion, pool = spring_criterion(choice.screened.parameters), choice.screened.subset(range(14))

    def trace(some):
        factor = pool.factor(some)
        return criterion.trace(factor.T @ factor)

    every = [trace(list(some)) for some in combinations(range(len(pool)), 4)]
    assert trace(exchange(pool, 4, criterion).chosen) <= 1.03 * min(every) < np.median(every) / 1.5
    assert trace(exchange(pool, 4, criterion, start=[0, 1, 2, 3]).chosen) <= 1.05 * min(every)
    factor = choice.screened.factor(choice.chosen)
    assert criterion.trace(factor.T @ factor) < 0.9 * min(every)  # poses near the chosen ones do better yet


def test_shaped_amplitudes_keep_all_limits_and_tell_more(tx90l, plan, choice, amplitudes):
    flat, found = amplitudes
    effort = np.array([tx90l.joints[k].effort for k in found.joints])
    rms = np.sqrt(np.sum(found.amplitude**2, axis=1) / 2 / 3)
    assert np.all(rms <= ROOM * EXCITATION * effort * (1 + 1e-9))
    for q in choice.poses:
        moved = closed_loop_motion(linearise(tx90l, q), found.frequencies_hz, found.kp[:3], found.kd[:3])[
            :, :3
        ]
        swing = np.sqrt(np.sum(np.abs(moved) ** 2 * found.amplitude.T[:, None] ** 2, axis=(0, 2)) / 2 / 3)
        assert np.all(CREST * swing < DROOP / 2)
    for q in choice.poses:
        assert amplitude_share(backlash_load(tx90l, q, found), found.amplitude) >= 1 - 1e-9
    over = found.amplitude / flat.plan.amplitude
    assert over.max() <= MOST + 1e-9
    np.testing.assert_array_equal(found.detection_lines, plan.detection_lines)
    assert not np.isin(found.detection_lines, found.lines).any()
    crests = [crest_factor(excitation_torque(replace(found, crest="optimised"), r, 0)).max() for r in (0, 1)]
    assert max(crests) < CREST
    planned = PlannedResponses.of(tx90l, found)
    criterion = spring_criterion(planned.parameters)
    before, after = (criterion.trace((f := x.sensitivity.factor()).T @ f) for x in (flat, planned))
    assert after < 0.85 * before
    assert max(np.median(r.relative_error(found)) for r in planned.responses) < 0.3


def test_gains_are_the_derivative_of_the_criterion(amplitudes):
    """∂ log tr(W M⁻¹) by the power of one line of one axis, nuisances eliminated, by central differences."""
    flat, _ = amplitudes
    criterion = spring_criterion(flat.parameters)

    def merit(plan):
        return criterion.merit(
            flat.prior_information + sum((r := x.rows(plan)).T @ r for x in flat.responses)
        )

    plan = flat.plan
    information = flat.prior_information + sum((r := x.rows(plan)).T @ r for x in flat.responses)
    gain = np.sum([x.gains(plan, criterion.gradient(information)) for x in flat.responses], axis=0)
    for axis, line in ((0, 5), (1, 11), (2, 20)):
        ends = []
        for side in (1, -1):
            power = plan.amplitude**2
            power[axis, line] *= 1 + side * 1e-4
            ends.append(merit(replace(plan, amplitude=np.sqrt(power))))
        expected = (ends[0] - ends[1]) / (2e-4 * plan.amplitude[axis, line] ** 2)
        assert gain[axis, line] == pytest.approx(expected, rel=1e-3)


def test_more_poses_tell_more_and_chosen_ones_more_than_random(choice):
    chosen, random = stiffness_curve(choice, np.arange(1, 7), np.random.default_rng(0))
    assert np.all(np.diff(chosen) < 0)
    assert np.all(chosen[1:] < random[1:])


def test_too_few_poses_name_the_spring(tx90l, plan):
    with refused("E-DESIGN-009", "1", "joint_3.bearing_y.stiffness"):
        choose_frequency_poses(
            tx90l, replace(plan, payload=0.0, amplitude=0.4 * plan.amplitude), 1, 3, np.random.default_rng(0)
        )


def test_no_room_for_the_motion_names_the_joint(tx90l, plan):
    wide = replace(plan, reference_amplitude=np.radians(200))
    with refused("E-DESIGN-002", "joint_1", "202"):
        FrequencyPoseCandidates(CollisionChecker(tx90l), wide)


def test_no_preload_anywhere_says_what_threw_poses_out(tx90l, plan):
    strong = replace(plan, amplitude=20 * plan.amplitude)
    with refused("E-DESIGN-003", "0", "3", "collision"):
        FrequencyPoseCandidates(CollisionChecker(tx90l), strong).random(3, np.random.default_rng(0))


def test_a_given_pose_that_does_not_load_a_gap_is_named(tx90l, plan):
    upright = replace(plan, poses=np.zeros((1, 6)))
    with refused("E-DESIGN-001", "1"):
        within_preload(tx90l, upright)


def test_a_payload_is_placed_where_turning_the_last_joint_would_bring_it(tx90l, plan, choice):
    """A quarter turn about the axis of joint 6 is a quarter turn of joint 6, but for the link's own small eccentricity."""
    excited = replace(plan, poses=choice.poses[:2], amplitude=0.5 * plan.amplitude)
    places = payload_placements(tx90l, excited)
    np.testing.assert_allclose(places[0].com, tx90l.payload.com, atol=1e-6)
    flange = tx90l.payload.rotation.T @ tx90l.joints[5].axis
    radii = [np.linalg.norm(np.cross(flange, p.com)) for p in places]
    np.testing.assert_allclose(radii, radii[0], rtol=1e-5)
    turned = replace(excited, poses=choice.poses[:2] + np.r_[np.zeros(5), np.pi / 2])
    assert payload_placements(tx90l, turned)[0].std == pytest.approx(places[2].std, rel=0.02)


def test_a_payload_on_the_axis_or_none_cannot_be_placed(tx90l, ur5, plan):
    place = tx90l.payload
    on_axis = place.rotation.T @ (0.2 * tx90l.joints[5].axis - place.translation)
    robot = tx90l.with_values({f"payload.com_{k}": x for k, x in zip("xyz", on_axis, strict=True)})
    with refused("E-DESIGN-008", "joint_6"):
        payload_placements(robot, plan)
    with refused("E-DESIGN-007"):
        payload_placements(tx90l, replace(plan, payload=0.0))
