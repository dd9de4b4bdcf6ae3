"""Sensors on the arm as further rows of the frequency response: exact without noise, with a covariance that the scatter bears out."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.frequency.periodic import local_polynomial_responses, pose_response

MIX = np.array([3.0, -2.0])
"""What the sensor reads is this mixture of the motors' displacements, and noise of its own."""


def sensing(recordings, plan, size, rng):
    """The recordings with a sensor that reads the mixture, with noise of the 1σ `size`."""
    for recording in recordings:
        moved = recording.q[:, list(plan.joints)] - plan.poses[0][list(plan.joints)]
        read = moved @ MIX + size * rng.standard_normal(len(recording))
        yield replace(recording, sensors=("probe",), sensed=read[:, None])


def expected(response, mechanism):
    """Rows of the motors and of the sensor (L, 3, 2) of the true mechanism."""
    true = mechanism.acceleration_response(response.omega)
    read = np.einsum("i,lij->lj", MIX, true) / -(response.omega[:, None] ** 2)
    return np.concatenate([true, read[:, None]], axis=1)


@pytest.mark.parametrize("method", ["arithmetic", "h1", "joint_input_output"])
def test_rows_of_a_sensor_without_noise(make_plan, linear_cell, mechanism, rng, method) -> None:
    plan = make_plan(rate_hz=1000.0)
    found = pose_response(plan, 0, sensing(linear_cell().record(plan, rng), plan, 0.0, rng), method)
    assert found.outputs == ("joint_1", "joint_3", "probe") and found.response.shape[1:] == (2, 2)
    truth = expected(found, mechanism)
    difference = np.abs(found.stacked - truth).max(axis=2) / np.linalg.norm(truth, axis=2)
    assert difference.max() < 2e-3
    alone = pose_response(plan, 0, linear_cell().record(plan, rng), method)
    np.testing.assert_array_equal(found.response, alone.response)


def test_joint_covariance_is_that_of_the_scatter(make_plan, linear_cell, mechanism) -> None:
    plan = make_plan()
    cell = linear_cell(position_noise=2e-5, process_noise=2.0)
    plain = linear_cell()
    truth, squares, cross = None, [], []
    for seed in range(40):
        rng = np.random.default_rng([3, seed])
        found = pose_response(plan, 0, sensing(cell.record(plan, rng), plan, 4e-5, rng))
        if truth is None:
            exact = np.random.default_rng(0)
            truth = pose_response(plan, 0, sensing(plain.record(plan, exact), plan, 0.0, exact)).stacked
        error = np.swapaxes(found.stacked - truth, 1, 2).reshape(len(truth), 6)
        white = np.linalg.solve(np.linalg.cholesky(found.stacked_covariance), error[:, :, None])[:, :, 0]
        squares.append(np.mean(np.abs(white) ** 2, axis=0))
        cross.append(np.mean(white[:, 0] * white[:, 2].conj()))
    # 45 degrees of freedom of a covariance of 6 elements: expectation 45/(45 - 6 - 1) or so
    assert np.all(np.abs(np.mean(squares, axis=0) - 1.1) < 0.25)
    assert abs(np.mean(cross)) < 0.1


def test_local_polynomial_method_has_the_rows_too(make_plan, linear_cell, mechanism, rng) -> None:
    plan = make_plan(rate_hz=1000.0, realisations=2)
    recordings = sensing(linear_cell().record(plan, rng), plan, 0.0, rng)
    (found,) = local_polynomial_responses(plan, recordings)
    truth = expected(found, mechanism)
    assert np.median(np.abs(found.stacked - truth).max(axis=2) / np.linalg.norm(truth, axis=2)) < 0.02


def test_what_does_not_fit_is_refused(make_plan, linear_cell, rng) -> None:
    plan = make_plan()
    with refused("E-FRF-038", "probe"):
        pose_response(plan, 0, sensing(linear_cell().record(plan, rng), plan, 1e-6, rng), "logarithmic")
    mixed = list(linear_cell().record(plan, rng))
    mixed[:3] = sensing(mixed[:3], plan, 1e-6, rng)
    with refused("E-FRF-027", "none", "probe"):
        pose_response(plan, 0, mixed)
