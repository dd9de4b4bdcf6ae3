"""Ĝ against the true transfer matrix, and what the reader of a frequency response can rely on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from refusals import refused

from flexcal.frequency.periodic import (
    FrequencyResponse,
    frequency_responses,
    leave_out_detection_lines,
    pose_response,
)


def relative_error(response, mechanism):
    true = mechanism.acceleration_response(response.omega)
    size = np.sqrt(np.einsum("lii,ljj->lij", np.abs(true), np.abs(true)))
    return (np.abs(response.response - true) / size).max()


def test_exact_hold_is_corrected(make_plan, linear_cell, mechanism, rng):
    """A zero-order-hold simulation at 1 kHz: 0.01 % after the correction (what is left is aliasing), 12 % without."""
    plan = make_plan(rate_hz=1000.0)
    recordings = list(linear_cell().record(plan, rng))
    assert relative_error(pose_response(plan, 0, recordings), mechanism) < 2e-4
    uncorrected = pose_response(replace(plan, torque="instantaneous"), 0, recordings)
    assert relative_error(uncorrected, mechanism) > 0.1


def test_subtraction_removes_reference_and_even_nonlinearity(make_plan, linear_cell, rng):
    plan = make_plan()
    plain = pose_response(plan, 0, linear_cell().record(plan, rng)).response
    moving = replace(plan, reference_amplitude=0.03)
    cell = linear_cell(reference_torque=40.0, even=lambda q: 300.0 * q**2 + 2e7 * q**4)
    removed = pose_response(moving, 0, cell.record(moving, rng))
    np.testing.assert_allclose(removed.response, plain, atol=1e-9 * np.abs(plain).max())
    one_sign = replace(moving, signs=False)
    kept = pose_response(one_sign, 0, cell.record(one_sign, rng)).response
    np.testing.assert_allclose(kept, plain, atol=1e-9 * np.abs(plain).max())  # even: only unexcited lines
    on_grid = replace(one_sign, reference_frequency_hz=13 * plan.base_frequency_hz)
    spoilt = pose_response(on_grid, 0, cell.record(on_grid, rng)).response
    assert np.abs(spoilt - plain).max() > 0.1 * np.abs(plain).max()


def test_result_describes_the_experiment(make_plan, linear_cell, rng, tmp_path):
    plan = make_plan(payload=2.0)
    found = pose_response(plan, 0, linear_cell(position_noise=1e-5).record(plan, rng), "logarithmic")
    n_lines = plan.lines.size
    assert found.response.shape == (n_lines, 2, 2) and found.covariance.shape == (n_lines, 4, 4)
    assert found.realisations.shape == (4, n_lines, 2, 2) and found.degrees_of_freedom == 45.0
    assert found.joints == ("joint_1", "joint_3") and found.average == "logarithmic"
    np.testing.assert_allclose(found.q_mean, plan.poses[0], atol=1e-6)
    np.testing.assert_array_equal(found.vec[:, 2], found.response[:, 0, 1])
    np.testing.assert_allclose(found.std[:, 1, 0] ** 2, found.covariance[:, 1, 1].real)
    np.testing.assert_allclose(
        found.log_covariance()[:, 3, 3].real, (found.std / np.abs(found.response))[:, 1, 1] ** 2
    )
    for matrices in (found.covariance, found.noise_covariance):
        np.testing.assert_allclose(
            matrices, np.swapaxes(matrices, 1, 2).conj(), atol=1e-12 * np.abs(matrices).max()
        )
        assert (np.linalg.eigvalsh(matrices) > 0.0).all()

    found.save(tmp_path / "response.npz")
    again = FrequencyResponse.load(tmp_path / "response.npz")
    for name, value in vars(found).items():
        np.testing.assert_array_equal(getattr(again, name), value)
        assert type(getattr(again, name)) is type(value)
    replace(found, payload=None).save(tmp_path / "response.npz")
    assert FrequencyResponse.load(tmp_path / "response.npz").payload is None


def test_loading_something_else_is_one_sentence(tmp_path):
    (tmp_path / "a.npz").write_text("no archive")
    np.savez(tmp_path / "b.npz", response=np.zeros(3))
    for name, code in (("a.npz", "E-FILE-003"), ("b.npz", "E-FRF-032")):
        with refused(code, name, "give what 'flexcal identify response' wrote"):
            FrequencyResponse.load(tmp_path / name)
    with refused("E-FRF-031"):
        FrequencyResponse.load(tmp_path / "missing.npz")


def test_poses_are_streamed_in_one_pass(make_plan, linear_cell, rng):
    plan = make_plan(poses=np.array([[0.1, 0.2, 0.3], [-1.0, 0.5, 0.0]]))
    recordings = list(linear_cell().record(plan, rng))
    found = list(frequency_responses(plan, iter(recordings), joint_names=("a", "b")))
    assert [one.pose for one in found] == [0, 1] and found[1].joints == ("a", "b")
    np.testing.assert_allclose(found[1].q_mean, plan.poses[1], atol=1e-6)
    shuffled = [recordings[i] for i in rng.permutation(len(recordings))]
    np.testing.assert_allclose(pose_response(plan, 1, shuffled).response, found[1].response, rtol=1e-12)
    with refused("E-FRF-024", "1", "16", "2", "pose_2_realisation_4_experiment_2_minus"):
        list(frequency_responses(plan, recordings[:-1]))


def test_bad_recordings_are_refused(make_plan, linear_cell, rng):
    plan = make_plan()
    good = list(linear_cell().record(plan, rng))
    first = good[0]

    def check(recordings, refusal, plan=plan, **options):
        with refused(*refusal):
            pose_response(plan, 0, recordings, **options)

    check(good[:-1], ["E-FRF-024", "pose_1_realisation_4_experiment_2_minus"])
    check([*good, first], ["E-FRF-025", "pose_1_realisation_1_experiment_1_plus is there twice"])
    check([], ["E-FRF-024", "16", "16"])
    check([replace(first, label=None)], ["E-FRF-029"])
    check(
        [replace(first, label=replace(first.label, realisation=7))],
        ["E-FRF-025", "pose_1_realisation_8_experiment_1_plus is not in the plan"],
    )
    check(
        [replace(first, q=first.q[:-1], torque=first.torque[:-1])],
        ["E-FRF-010", "pose_1_realisation_1_experiment_1_plus", "1599", "1600"],
    )
    check(
        [*good[:-1], replace(good[-1], time_step=0.01)],
        ["E-FRF-026", "pose_1_realisation_4_experiment_2_minus", "its sample time is 0.01"],
    )
    torque = first.torque.copy()
    torque[-3] = np.nan
    check([replace(first, torque=torque, file=Path("a/log.csv"))], ["E-FRF-028", "a/log.csv"])
    check(
        [replace(one, time_step=0.01) for one in good],
        ["E-FRF-009", "pose_1_realisation_1_experiment_1_plus", "0.01"],
    )
    check([replace(one, torque=0.0 * one.torque) for one in good], ["E-FRF-039"])
    check(good, ["E-FRF-040"], joint_names=("a",))
    check(good, ["E-FRF-008", "median"], average="median")
    few = replace(plan, realisations=1)
    check([one for one in good if one.label.realisation == 0], ["E-FRF-037"], few)


def test_lines_left_out_show_the_odd_distortion(make_plan, linear_cell, rng):
    """A cubic in the position, with noise: what is found is what the spectrum of the cubic itself has there, axis by axis."""
    plan = leave_out_detection_lines(make_plan(realisations=4))
    gain = np.array([8e3, 2e3])

    def cubic(position):
        return gain * position**3

    noise = 2e-7
    found = pose_response(plan, 0, linear_cell(even=cubic, position_noise=noise).record(plan, rng))
    bent, straight = [], []
    for recording in linear_cell().record(plan, rng):
        moved = recording.q[-400:, [0, 2]] - recording.q[-400:, [0, 2]].mean(0)
        for kept, lines, signal in (
            (bent, plan.detection_lines, cubic(moved)),
            (straight, plan.lines, moved),
        ):
            kept.append(np.fft.rfft(signal, axis=0)[lines] * lines[:, None] ** 2)
    expected = np.sqrt(np.mean(np.abs(bent) ** 2, axis=(0, 1)) / np.mean(np.abs(straight) ** 2, axis=(0, 1)))
    assert expected.min() > 1e-3
    np.testing.assert_allclose(found.odd_distortion, expected, rtol=0.2)
    linear = pose_response(plan, 0, linear_cell(position_noise=noise).record(plan, rng))
    assert (linear.odd_distortion < 0.2 * expected).all()
    assert pose_response(make_plan(), 0, linear_cell().record(make_plan(), rng)).odd_distortion is None
