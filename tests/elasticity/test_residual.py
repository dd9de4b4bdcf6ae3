"""The residual of stage 1: its derivatives, its weights, and its robustness against phase wraps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResonanceWeighting,
    ResponseModel,
    ResponseResidual,
    UniformWeighting,
    stiffness_parameters,
)
from flexcal.elasticity.response_model.residual import PoseResidual
from flexcal.elasticity.response_model.weighting import extrema


@pytest.mark.parametrize("weighting", [CovarianceWeighting(), UniformWeighting(), ResonanceWeighting()])
def test_jacobian_is_that_of_finite_differences(tx90l, poses, synthesise, drawn, weighting, rng):
    responses = synthesise(
        drawn(tx90l, rng, inertias=True), poses["default"][:2], noise=0.1, rng=rng, step=24
    )
    parameters = stiffness_parameters(tx90l, responses)
    residual = ResponseResidual.of(ResponseModel.of(tx90l, responses, parameters), responses, weighting)
    assert not residual.poses[0].logarithmic.all()
    assert residual.poses[0].logarithmic.any()
    unit = np.array([{"s": 1e-3, "m": 0.1}.get(unit, 1.0) for unit in parameters.units])
    x = parameters.coordinates() + 0.05 * unit * rng.standard_normal(len(parameters))
    rows, jacobian = residual.linearise(x)
    np.testing.assert_allclose(rows, residual.residual(x), rtol=1e-12)
    for k, size in enumerate(unit):
        step = np.zeros(len(x))
        step[k] = 1e-5 * size
        numeric = (residual.residual(x + step) - residual.residual(x - step)) / (2 * step[k])
        np.testing.assert_allclose(jacobian[:, k], numeric, atol=1e-5 * np.abs(jacobian[:, k]).max() + 1e-9)


def test_whitened_noise_has_unit_variance(tx90l, poses, synthesise, rng):
    exact = synthesise(tx90l, poses["default"][:1], noise=0.02, step=1)[0]
    rows = []
    for _ in range(40):
        noisy = synthesise(tx90l, poses["default"][:1], noise=0.02, rng=rng, step=1)[0]
        rows.append(PoseResidual.of(noisy, CovarianceWeighting()).residual(exact.response))
    scatter = np.cov(np.array(rows).reshape(-1, 18).T)
    np.testing.assert_allclose(scatter, np.eye(18), atol=0.1)


def test_outputs_that_are_known_from_each_other_have_linear_errors(tx90l, poses, synthesise, rng):
    """Disturbances of the torques scatter all outputs by 8 % together: logarithms, whose second-order terms differ from output to output,
    are not for rows whose ratio is known to a thousandth; errors that are linear in the response have unit variance."""
    exact = synthesise(tx90l, poses["default"][:1], noise=0.05, step=4)[0]
    g = np.concatenate([exact.response, exact.response[:, :1] + 0.5 * exact.response[:, 1:2]], axis=1)
    lines, (m, n) = len(g), g.shape[1:]
    own = (1e-3 * np.linalg.norm(g, axis=2)) ** 2  # of every reading alone
    one = 0.08**2 * g @ np.swapaxes(g, 1, 2).conj() + own[:, :, None] * np.eye(m)
    covariance = np.zeros((lines, n * m, n * m), dtype=complex)
    for c in range(n):
        covariance[:, m * c : m * c + m, m * c : m * c + m] = one
    squares = []
    for _ in range(20):
        draw = rng.standard_normal((2, lines, m, n)) / np.sqrt(2)
        stacked = g + np.linalg.cholesky(one) @ (draw[0] + 1j * draw[1])
        rows = (np.arange(n)[:, None] * m + np.arange(n)).ravel()
        noisy = replace(
            exact, response=stacked[:, :n], covariance=covariance[:, rows[:, None], rows],
            sensors=("hand",), sensor_response=stacked[:, n:], joint_covariance=covariance,
        )  # fmt: skip
        residual = PoseResidual.of(noisy, CovarianceWeighting())
        squares.append(np.mean(residual.residual(g) ** 2))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.02)


def test_phase_wraps_do_not_matter(tx90l, poses, synthesise):
    """A delay that turns the phase through ±π leaves the error a small number: it is the log of the ratio."""
    response = synthesise(tx90l.with_values({"joint_1.delay": 8e-3}), poses["default"][:1], noise=1e-3)[0]
    nearly = synthesise(tx90l.with_values({"joint_1.delay": 8.1e-3}), poses["default"][:1], noise=1e-3)[
        0
    ].response
    assert np.ptp(np.angle(response.response[:, 0, 0])) > 5
    errors = PoseResidual.of(response, CovarianceWeighting()).errors(nearly)
    assert np.abs(errors[:, 0, 0]).max() < 2 * np.pi * 80 * 1.01e-4


def test_paper_weighting_stresses_poles_and_zeros(tx90l, poses, synthesise):
    response = synthesise(tx90l, poses["default"][:1], noise=1e-2, step=1)[0]
    factor = ResonanceWeighting().factor(response, response.covariance)
    weight = factor[:, 0, 0] / factor[:, 0, 0].min()
    assert weight.max() == pytest.approx(3.0, rel=1e-3)
    curve = np.log(np.abs(response.response[:, 0, 0]))
    assert weight[np.argmax(curve)] == pytest.approx(3.0, rel=1e-3)
    assert factor[0, 1, 1] < factor[0, 0, 0]


def test_extrema_alternate_and_ignore_ripple():
    t = np.linspace(0, 4 * np.pi, 200)
    found = extrema(np.sin(t) + 0.01 * np.sin(40 * t), 0.5)
    np.testing.assert_allclose(np.sin(t[found]), [1, -1, 1, -1], atol=0.02)


def test_unfit_responses_are_refused(tx90l, ur5, poses, synthesise):
    responses = synthesise(tx90l, poses["default"][:1], noise=1e-2, step=40)
    with refused("E-STIFF-002"):
        stiffness_parameters(ur5, responses)
    with refused("E-STIFF-003"):
        stiffness_parameters(tx90l, [])
