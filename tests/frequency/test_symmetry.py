"""Reciprocity of frequency responses: of the equations of motion, of noise, and what breaks it."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.frequency.periodic import FrequencyResponse, reciprocity

LINES, POSES = 60, 4
NOISE = 0.02


def measured(pose: int, gains: tuple[float, ...] = (1.0, 1.0, 1.0)) -> FrequencyResponse:
    """ω² (K − ω² M + i ω D)⁻¹ of random symmetric positive definite matrices, with correlated errors of known covariance."""
    rng = np.random.default_rng(pose)
    mass, stiffness, damping = (factor @ factor.T for factor in rng.normal(size=(3, 3, 3)))
    omega = np.linspace(1.0, 3.0, LINES)[:, None, None]
    exact = omega**2 * np.linalg.inv(stiffness - omega**2 * mass + 0.3j * omega * damping)
    mixing = NOISE * rng.normal(size=(9, 9))
    errors = (rng.normal(size=(LINES, 9)) + 1j * rng.normal(size=(LINES, 9))) / np.sqrt(2.0) @ mixing.T
    response = exact + np.swapaxes(errors.reshape(LINES, 3, 3), 1, 2)
    covariance = np.tile((mixing @ mixing.T).astype(complex), (LINES, 1, 1))
    found = FrequencyResponse(
        frequencies_hz=omega.ravel() / (2 * np.pi),
        response=response,
        covariance=covariance,
        noise_covariance=covariance,
        degrees_of_freedom=45.0,
        realisations=response[None],
        joints=("a", "b", "c"),
        q_mean=np.zeros(3),
        payload=None,
        pose=pose,
        sample_time=1e-3,
    )
    scale = np.repeat(gains, 3)
    return replace(
        found,
        response=response * gains,
        covariance=covariance * scale[:, None] * scale[None, :],
    )


def test_a_mechanical_system_is_reciprocal() -> None:
    """The difference is as large as its covariance says, to a tenth with 240 lines."""
    pairs = reciprocity([measured(pose) for pose in range(POSES)])
    assert [pair.joints for pair in pairs] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert [pair.lines for pair in pairs] == [LINES * POSES] * 3
    assert [pair.ratio for pair in pairs] == pytest.approx([1.0] * 3, abs=0.1)
    assert max(pair.difference for pair in pairs) < 0.05


def test_torque_gain_of_one_axis_breaks_it() -> None:
    """Torques of b that are stated too small by 1.5: the pairs with b differ by log-mean 0.4 of their size."""
    first, second, third = reciprocity([measured(pose, (1.0, 1.5, 1.0)) for pose in range(POSES)])
    assert min(first.ratio, third.ratio) > 2.0 and second.ratio == pytest.approx(1.0, abs=0.1)
    exact = 0.5 / np.sqrt((1.0 + 1.5**2) / 2)
    assert [first.difference, third.difference] == pytest.approx([exact] * 2, abs=0.03)


def test_one_axis_has_no_pairs() -> None:
    whole = measured(0)
    single = replace(
        whole,
        response=whole.response[:, :1, :1],
        covariance=whole.covariance[:, :1, :1],
        joints=("a",),
    )
    assert reciprocity([single]) == ()
