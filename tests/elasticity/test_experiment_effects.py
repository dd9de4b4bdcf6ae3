"""What the experiment itself does to the response: reference motion, open gaps, and what is left as model error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.response_model import Tolerances
from flexcal.elasticity.response_model.model_error import LowRank
from flexcal.elasticity.time_periodic import DriveTorque, ReferenceMotion, reference_shift
from flexcal.model.vibration import linearise, multisine_torque, over_frequency, transfer_matrix

FREE = np.zeros(3)
STILL = np.zeros((3, 1))


def plan_of(model, poses, *, amplitude=3.0, reference=0.0):
    """A plan for a few lines."""
    lines = np.arange(13, 320, 2)
    controller = model.controller
    return MultisinePlan(
        name="test", poses=poses, joints=(0, 1, 2), base_frequency_hz=0.25, lines=lines,
        amplitude=np.full((3, len(lines)), amplitude), periods=4, settle_periods=2, realisations=4, signs=True,
        reference_amplitude=reference, reference_frequency_hz=2.125, kp=controller.kp, kd=controller.kd, rate_hz=4000.0,
        torque="held", seed=0,
    )  # fmt: skip


def test_very_slow_motion_averages_the_frozen_responses(tx90l, poses):
    """In the quasi-static limit with free motors the response is the mean of the responses along the motion."""
    q, frequencies, size = poses["default"][1], np.linspace(5, 60, 23), np.deg2rad(0.5)
    motion = ReferenceMotion(size, 1e-5, FREE, FREE, STILL)
    shift = reference_shift(tx90l, q, None, frequencies, motion)
    still = transfer_matrix(linearise(tx90l, q), frequencies).response
    frozen = []
    for angle in 2 * np.pi * np.arange(8) / 8:
        at = q.copy()
        at[:3] += size * np.sin(angle)
        frozen.append(transfer_matrix(linearise(tx90l, at), frequencies).response)
    expected = np.mean(frozen, axis=0) - still
    np.testing.assert_allclose(shift, expected, atol=0.05 * np.abs(expected).max())


def test_shift_is_quadratic_in_the_amplitude_and_vanishes_at_rest(tx90l, poses):
    q, frequencies = poses["default"][0], np.linspace(5, 60, 23)
    kp, kd = np.array(tx90l.controller.kp[:3]), np.array(tx90l.controller.kd[:3])
    shifts = [
        reference_shift(tx90l, q, None, frequencies, ReferenceMotion(size, 2.125, kp, kd, STILL))
        for size in (0.0, 1e-3, 2e-3)
    ]
    assert not shifts[0].any()
    np.testing.assert_allclose(shifts[2], 4 * shifts[1], atol=0.02 * np.abs(shifts[2]).max())


def test_compliance_of_a_gap(tx90l, poses, rng):
    """That of the twist against a Gaussian torque through zero; a drive held far from zero torque never opens its gap."""
    q, plan = poses["default"][0], plan_of(tx90l, poses["default"][:1])
    added = DriveTorque.of(tx90l, q, None, plan).backlash_compliance().mean(axis=0)
    motion, system = ReferenceMotion.of(plan), linearise(tx90l, q)
    size = multisine_torque(tx90l, system, plan.frequencies_hz, motion.excitation, motion.kp, motion.kd)
    torque = size[0] * rng.standard_normal(400_000)
    stiffness, half_gap = tx90l.springs.stiffness[0, 2], 5e-5
    twist = torque / stiffness + half_gap * np.sign(torque)
    compliance = (twist @ torque) / (torque @ torque)
    assert half_gap * added[0] > 0.2
    assert 1 / stiffness * (1 + half_gap * added[0]) == pytest.approx(compliance, rel=2e-3)
    assert 1e-5 * added[1] < 1e-6
    swaying = replace(plan, reference_amplitude=np.deg2rad(3.0))
    moving = DriveTorque.of(tx90l, q, None, swaying).backlash_compliance()
    assert moving.mean(axis=0)[1] > added[1]


def test_low_rank_whitening(rng):
    columns = rng.standard_normal((30, 4))
    whitening = LowRank.of(columns).whiten(np.eye(30))
    covariance = np.eye(30) + columns @ columns.T
    np.testing.assert_allclose(whitening @ covariance @ whitening.T, np.eye(30), atol=1e-12)
    assert LowRank.of(columns).log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1])


def test_knots_add_up_to_the_whole(rng):
    frequencies = np.linspace(3, 80, 40)
    change = rng.standard_normal((40, 3, 3, 2)) + 0j
    spread = over_frequency(change, frequencies, 0.5)
    half = spread.shape[-1] // 2
    whole = spread[..., :half].reshape(40, 3, 3, 2, -1).sum(axis=-1)
    np.testing.assert_allclose(whole, change, atol=1e-12)
    np.testing.assert_allclose(spread[..., half:], 1j * spread[..., :half])


def test_no_tolerances_leave_nothing_out():
    assert not Tolerances.none().any
    assert Tolerances().any
