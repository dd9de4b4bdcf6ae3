import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexcal.estimation import Cauchy, Huber, Parameter, Parameters, Problem, Squares, solve

LOSSES = [Squares(), Huber(), Cauchy(), Huber(2.0)]


@pytest.mark.parametrize("loss", LOSSES)
@given(norm=st.floats(1e-3, 50))
def test_weight_and_curvature_are_derivatives_of_the_cost(loss, norm):
    step, threshold = 1e-5, loss.thresholds(np.array([1]))
    if abs(norm - threshold[0]) < 1e-3:
        return
    cost = [loss.cost(np.array([norm + d]), threshold)[0] for d in (-step, 0.0, step)]
    weight = loss.weight(np.array([norm]), threshold)[0]
    slopes = [loss.weight(np.array([norm + d]), threshold)[0] * (norm + d) for d in (-step, step)]
    assert (cost[2] - cost[0]) / (2 * step) == pytest.approx(weight * norm, rel=1e-4)
    assert (slopes[1] - slopes[0]) / (2 * step) == pytest.approx(
        loss.curvature(np.array([norm]), threshold)[0], rel=1e-4, abs=1e-6
    )


@pytest.mark.parametrize("size", [1, 3, 18])
def test_groups_of_any_size_exceed_the_threshold_equally_often(size):
    norms = np.linalg.norm(np.random.default_rng(0).standard_normal((20000, size)), axis=1)
    threshold = Huber().thresholds(np.array([size]))[0]
    assert np.mean(norms > threshold) == pytest.approx(0.1786, abs=0.01)
    if size == 1:
        assert threshold == pytest.approx(1.345)


def points_with_outliers(seed, share=0.1):
    """A line in space, points of three rows each, some 8 to 20 standard deviations off."""
    rng = np.random.default_rng(seed)
    points = 200
    design = rng.standard_normal((3 * points, 4))
    truth = np.array([1.0, -2.0, 0.5, 3.0])
    errors = rng.standard_normal((points, 3))
    wrong = rng.permutation(points)[: int(share * points)]
    directions = rng.standard_normal((wrong.size, 3)) + 1.0
    errors[wrong] += (
        directions / np.linalg.norm(directions, axis=1)[:, None] * rng.uniform(12, 25, (wrong.size, 1))
    )
    measured = design @ truth + errors.ravel()
    parameters = Parameters(Parameter(name, "m", 0.0) for name in "abcd")
    groups = np.repeat(np.arange(points) + 1000, 3)
    problem = Problem(parameters, lambda x: (measured - design @ x, -design), groups=groups)
    return problem, truth, set((wrong + 1000).tolist())


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_outliers_are_found_and_lose_their_influence(loss):
    problem, truth, wrong = points_with_outliers(1)
    plain, robust = solve(problem), solve(problem, loss=loss)
    assert robust.converged
    assert set(robust.outliers) <= wrong
    assert len(robust.outliers) >= 0.9 * len(wrong)
    assert plain.outliers == ()
    assert plain.reduced_chi2 > 3.0
    error = np.linalg.norm(list(robust.values.values()) - truth)
    assert error < 0.5 * np.linalg.norm(list(plain.values.values()) - truth)


def test_huber_agrees_with_scipy():
    from scipy.optimize import least_squares

    rng = np.random.default_rng(3)
    design, measured = rng.standard_normal((80, 3)), rng.standard_t(2, 80)
    parameters = Parameters(Parameter(name, "m", 0.0) for name in "abc")
    ours = solve(Problem(parameters, lambda x: (measured - design @ x, -design)), loss="huber")
    theirs = least_squares(
        lambda x: measured - design @ x,
        np.zeros(3),
        loss="huber",
        f_scale=1.345,
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-12,
    )
    np.testing.assert_allclose(list(ours.values.values()), theirs.x, rtol=1e-5)
    assert ours.cost == pytest.approx(theirs.cost)


@pytest.mark.parametrize("covariance", ["posterior", "sandwich"])
@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_robust_standard_deviations_match_the_scatter_on_clean_data(loss, covariance):
    scaled = []
    for seed in range(60):
        problem, truth, _ = points_with_outliers(seed, share=0.0)
        estimate = solve(problem, loss=loss, covariance=covariance)
        scaled.append((list(estimate.values.values()) - truth) / np.sqrt(np.diag(estimate.covariance)))
    assert np.sqrt(np.mean(np.square(scaled))) == pytest.approx(1.0, abs=0.12)
