import math
from dataclasses import replace

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import refused

from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter, Parameters, Problem, solve


def linear_problem(
    design, measured, *, prior_std=math.inf, covariance=None, groups=None, bounds=None, start=0.0
):
    names = [f"p{i}" for i in range(design.shape[1])]
    low, high = bounds or (-math.inf, math.inf)
    parameters = Parameters(Parameter(name, "m", start, low, high, prior_std) for name in names)
    return Problem(parameters, lambda x: (measured - design @ x, -design), None, covariance, groups)


def decay_problem(seed, *, size=60, noise=0.02, start=(1.0, 1.0)):
    """y = a exp(-k t) with both on a log scale; truth a = 2, k = 0.7."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 5, size)
    y = 2.0 * np.exp(-0.7 * t) + noise * rng.standard_normal(size)

    def linearise(x):
        a, k = np.exp(x)
        model = a * np.exp(-k * t)
        return (y - model) / noise, -np.stack([model, -k * t * model], axis=1) / noise

    parameters = Parameters(Parameter(n, "", s, scale="log") for n, s in zip("ak", start, strict=True))
    return Problem(parameters, linearise, lambda x: linearise(x)[0])


def test_a_linear_problem_has_its_closed_form():
    rng = np.random.default_rng(1)
    design = rng.standard_normal((30, 4)) * [1.0, 1e5, 1e-4, 10.0]
    measured = rng.standard_normal(30)
    estimate = solve(linear_problem(design, measured))
    expected, chi2 = np.linalg.lstsq(design / [1.0, 1e5, 1e-4, 10.0], measured)[:2]
    np.testing.assert_allclose(list(estimate.values.values()), expected / [1.0, 1e5, 1e-4, 10.0], rtol=1e-8)
    np.testing.assert_allclose(estimate.chi2, chi2[0], rtol=1e-10)
    np.testing.assert_allclose(estimate.covariance @ design.T @ design, np.eye(4), atol=1e-7)
    assert estimate.cost == pytest.approx(estimate.chi2 / 2)
    assert (estimate.rank, estimate.degrees_of_freedom, estimate.status) == (4, 26, "converged")
    assert estimate.identifiable == (True,) * 4


@pytest.mark.parametrize("full", [False, True])
def test_a_prior_is_ridge_regression(full):
    rng = np.random.default_rng(2)
    design, measured = rng.standard_normal((6, 9)), rng.standard_normal(6)
    root = rng.standard_normal((9, 9))
    covariance = root @ root.T + np.eye(9) if full else np.eye(9) * 0.25
    estimate = solve(linear_problem(design, measured, prior_std=0.5, covariance=covariance if full else None))
    gain = covariance @ design.T @ np.linalg.solve(design @ covariance @ design.T + np.eye(6), np.eye(6))
    np.testing.assert_allclose(list(estimate.values.values()), gain @ measured, atol=1e-9)
    np.testing.assert_allclose(estimate.covariance, covariance - gain @ design @ covariance, atol=1e-9)
    assert estimate.rank == 9
    assert estimate.degrees_of_freedom == round(6 - np.trace(design @ gain))


def test_a_prior_on_some_parameters_only():
    rng = np.random.default_rng(3)
    design, measured = rng.standard_normal((20, 3)), rng.standard_normal(20)
    covariance = np.diag([np.inf, 0.04, np.inf])
    estimate = solve(linear_problem(design, measured, covariance=covariance))
    information = design.T @ design + np.diag([0.0, 25.0, 0.0])
    np.testing.assert_allclose(
        list(estimate.values.values()), np.linalg.solve(information, design.T @ measured)
    )


def test_noiseless_data_give_the_truth_to_machine_precision():
    estimate = solve(decay_problem(0, noise=1e-12, start=(5.0, 0.1)))
    assert estimate.converged
    assert estimate.values["a"] == pytest.approx(2.0, rel=1e-12)
    assert estimate.values["k"] == pytest.approx(0.7, rel=1e-12)


def test_parameters_at_zero_converge_from_exact_data():
    design = np.random.default_rng(4).standard_normal((20, 3))
    estimate = solve(linear_problem(design, np.zeros(20), start=1.0))
    assert estimate.converged
    np.testing.assert_allclose(list(estimate.values.values()), 0.0, atol=1e-12)


def test_bounds_hold_and_the_others_stay_optimal():
    rng = np.random.default_rng(5)
    design = rng.standard_normal((40, 3)) + 0.5
    measured = design @ [2.0, -1.0, 0.5] + 0.1 * rng.standard_normal(40)
    estimate = solve(linear_problem(design, measured, bounds=(-0.3, 1.2)))
    from scipy.optimize import lsq_linear

    expected = lsq_linear(design, measured, (-0.3, 1.2), tol=1e-14)
    assert estimate.converged
    np.testing.assert_allclose(list(estimate.values.values()), expected.x, atol=1e-6)


def test_everything_at_a_bound_or_nothing_determined():
    design = np.random.default_rng(11).standard_normal((10, 2))
    pinned = solve(linear_problem(design, design @ [5.0, 5.0], bounds=(-1.0, 1.0), start=1.0))
    assert pinned.converged and list(pinned.values.values()) == [1.0, 1.0]
    nothing = solve(linear_problem(0.0 * design, np.ones(10)))
    assert (nothing.rank, nothing.identifiable, nothing.degrees_of_freedom) == (0, (False, False), 10)


def held(seed, options):
    estimate = solve(decay_problem(seed, start=(2.5, 0.5)), **options)
    ends = {name: estimate.interval(name) for name in "ak"}
    return [ends["a"][0] <= 2.0 <= ends["a"][1], ends["k"][0] <= 0.7 <= ends["k"][1]]


def test_intervals_cover():
    assert 0.89 <= np.mean([held(seed, {}) for seed in range(100)]) <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [{}, {"covariance": "sandwich"}, {"loss": "huber"}, {"loss": "huber", "covariance": "sandwich"}],
)
def test_intervals_cover_over_many_seeds(options):
    share = np.mean(over_seeds(held, range(1000), options))
    print(f"{100 * share:.2f} % of 2000 intervals, {options}")
    assert 0.93 <= share <= 0.97


def test_chi2_of_a_right_model_is_its_degrees_of_freedom():
    ratios = [solve(decay_problem(seed)).reduced_chi2 for seed in range(100)]
    assert np.mean(ratios) == pytest.approx(1.0, abs=4 * math.sqrt(2 / 58 / 100))


def test_chi2_with_a_prior_that_the_truth_is_drawn_from():
    rng = np.random.default_rng(6)
    design = rng.standard_normal((20, 8))
    chi2 = []
    for _ in range(300):
        measured = design @ (0.3 * rng.standard_normal(8)) + rng.standard_normal(20)
        estimate = solve(linear_problem(design, measured, prior_std=0.3))
        chi2.append(estimate.chi2)
    assert np.mean(chi2) == pytest.approx(estimate.degrees_of_freedom, abs=1.5)


def test_what_is_exactly_tied_is_dropped_named_and_mapped():
    rng = np.random.default_rng(7)
    design = rng.standard_normal((50, 5)) * [1, 1e3, 1, 1e-3, 1]
    design[:, 2] = 2e-3 * design[:, 1] - 3e3 * design[:, 3]
    truth = dict(zip(("p0", "p1", "p2", "p3", "p4"), (0.4, 0.002, 0.7, 30.0, -0.1), strict=True))
    measured = design @ list(truth.values())
    problem = linear_problem(design, measured)
    estimate = solve(problem, prefer=("p1", "p3"))
    assert estimate.rank == 4
    assert estimate.identifiable == (True, True, False, True, True)
    (dropped,) = estimate.dropped
    assert dropped.name == "p2"
    assert dict(dropped.absorbed_by) == pytest.approx({"p1": 2e-3, "p3": -3e3})
    assert estimate.values["p2"] == 0.0, "a dropped parameter stays at its start"
    assert estimate.values == pytest.approx(estimate.regrouped(truth), rel=1e-8)
    assert "rank 4 of 5" in estimate.message
    quantity = estimate.quantity("p2", truth=0.7)
    assert quantity == {
        "estimate": 0.0,
        "std": None,
        "low": None,
        "high": None,
        "truth": 0.7,
        "identifiable": False,
        "bound": None,
    }
    kept = design[:, [0, 1, 3, 4]]
    np.testing.assert_allclose(
        design @ estimate.covariance @ design.T, kept @ np.linalg.pinv(kept), atol=1e-9
    )  # predictions: the hat matrix of the kept columns


def test_a_product_of_unknowns_is_one_unknown():
    t = np.linspace(0.1, 2, 30)

    def linearise(x):
        model = x[0] * x[1] * t
        return (6.0 * t - model) / 0.01, -np.stack([x[1] * t, x[0] * t], axis=1) / 0.01

    parameters = Parameters([Parameter("a", "", 2.5), Parameter("b", "", 1.0)])
    estimate = solve(Problem(parameters, linearise), prefer=("b",))
    assert estimate.rank == 1
    assert estimate.values == pytest.approx({"a": 2.5, "b": 2.4})
    assert estimate.std("a") is None


def test_a_parameter_that_nothing_depends_on():
    design = np.random.default_rng(8).standard_normal((20, 3)) * [1, 0, 1]
    estimate = solve(linear_problem(design, np.ones(20), start=0.5))
    assert estimate.dropped[0].absorbed_by == ()
    assert estimate.values["p1"] == 0.5


@pytest.mark.parametrize(("prior_std", "identifiable"), [(0.25, True), (0.26, False)])
def test_a_log_parameter_is_identifiable_within_a_factor_of_two(prior_std, identifiable):
    parameters = Parameters([Parameter("k", "N m/rad", 1e5, prior_std=prior_std, scale="log")])
    estimate = solve(Problem(parameters, lambda x: (np.ones(5), np.zeros((5, 1)))))
    assert estimate.rank == 1
    assert estimate.identifiable == (identifiable,)
    if identifiable:
        low, high = estimate.interval("k")
        assert low * high == pytest.approx(1e10)
        assert high < 2e5
        assert estimate.std("k") == pytest.approx(0.25e5)


def test_sandwich_sees_noise_that_the_whitening_missed():
    rng = np.random.default_rng(9)
    groups = np.repeat(np.arange(300), 4)
    design = np.repeat(rng.standard_normal((300, 3)), 4, axis=0)
    spread = 0.5 + np.abs(design[:, 0])
    found, reported = [], []
    for _ in range(60):
        measured = spread * np.repeat(rng.standard_normal(300), 4)
        estimate = solve(linear_problem(design, measured, groups=groups), covariance="sandwich")
        found.append(list(estimate.values.values()))
        reported.append(np.sqrt(np.diag(estimate.covariance)))
    inside = np.linalg.pinv(design)
    same_group = groups[:, None] == groups
    true_std = np.sqrt(np.diag(inside @ (np.outer(spread, spread) * same_group) @ inside.T))
    np.testing.assert_allclose(np.mean(reported, axis=0), true_std, rtol=0.06)
    np.testing.assert_allclose(np.std(found, axis=0), true_std, rtol=0.3)


def test_sandwich_agrees_with_the_posterior_when_the_whitening_is_right():
    rng = np.random.default_rng(10)
    design = rng.standard_normal((4000, 3))
    problem = linear_problem(design, rng.standard_normal(4000), prior_std=0.02)
    posterior, sandwich = solve(problem), solve(problem, covariance="sandwich")
    np.testing.assert_allclose(np.diag(sandwich.covariance), np.diag(posterior.covariance), rtol=0.1)


def test_multi_start_finds_the_better_of_two_minima():
    def linearise(x):  # minima near -1 and 1, the latter deeper
        return np.array([x[0] ** 2 - 1, 0.3 * (x[0] - 1)]) * 10, np.array([[2 * x[0]], [0.3]]) * 10

    problem = Problem(Parameters([Parameter("x", "", -1.0)]), linearise)
    assert solve(problem).values["x"] < 0
    estimate = solve(problem, starts=np.array([[-2.0], [0.5], [2.0]]))
    assert estimate.values["x"] == pytest.approx(1.0)
    assert "2 of 3 starts" in estimate.message


def test_progress_and_the_iteration_limit_are_told():
    seen = []
    estimate = solve(
        decay_problem(0), max_iterations=2, progress=lambda stage, share: seen.append((stage, share))
    )
    assert estimate.status == "iteration limit" and "allow more" in estimate.message
    assert seen == [("fitting", 0.0), ("fitting", 0.5), ("fitting", 1.0)]


def test_a_wrong_jacobian_is_suspected():
    problem = Problem(Parameters([Parameter("x", "", 3.0)]), lambda x: (x[:1] - 1.0, -np.ones((1, 1))))
    estimate = solve(problem)
    assert estimate.status == "stalled" and "not at a minimum" in estimate.message


def test_steps_into_the_impossible_are_taken_back():
    def residual(x):
        if x[0] <= 0:
            raise FlexcalError("E-TEST-001", "no equilibrium")
        return np.array([np.log(x[0]) + 3.0, 0.1])

    problem = Problem(
        Parameters([Parameter("x", "", 5.0)]),
        lambda x: (residual(x), np.array([[1 / x[0]], [0.0]])),
        residual,
    )
    assert solve(problem).values["x"] == pytest.approx(math.exp(-3.0))


@pytest.mark.parametrize(
    ("linearise", "options", "refusal"),
    [
        (lambda x: (np.array([1.0, np.nan]), np.ones((2, 1))), {}, ["E-FIT-009", "1"]),
        (
            lambda x: (np.ones(2), np.full((2, 1), np.inf)),
            {},
            ["E-FIT-010", "x"],
        ),
        (lambda x: (np.ones(2), np.ones((2, 3))), {}, ["E-FIT-008"]),
        (lambda x: (np.ones(2), np.ones((2, 1))), {"loss": "absolute"}, ["E-FIT-006", "absolute"]),
        (lambda x: (np.ones(2), np.ones((2, 1))), {"covariance": "magic"}, ["E-FIT-026", "magic"]),
        (lambda x: (np.ones(2), np.ones((2, 1))), {"starts": np.ones(3)}, ["E-FIT-029"]),
        (lambda x: (np.ones(2), np.ones((2, 1))), {"starts": np.ones((0, 1))}, ["E-FIT-027"]),
        (lambda x: (np.ones(2), np.ones((2, 1))), {"covariance": "sandwich"}, ["E-FIT-030"]),
        (lambda x: (np.ones(2), np.ones((2, 1))), {"prefer": ("y",)}, ["E-FIT-002", "y"]),
    ],
)
def test_bad_problems_are_refused_in_a_sentence(linearise, options, refusal: list[str]):
    with refused(*refusal):
        solve(Problem(Parameters([Parameter("x", "", 1.0)]), linearise), **options)


@pytest.mark.parametrize(
    ("covariance", "refusal"),
    [
        (np.eye(3), ["E-FIT-019"]),
        (np.diag([1.0, 0.0]), ["E-FIT-020", "p1"]),
        (np.ones((2, 2)), ["E-FIT-021"]),
    ],
)
def test_bad_priors_are_refused_in_a_sentence(covariance, refusal: list[str]):
    with refused(*refusal):
        solve(linear_problem(np.ones((4, 2)), np.ones(4), covariance=covariance))


def test_bad_groups_are_refused_in_a_sentence():
    with refused("E-FIT-007", "4"):
        solve(linear_problem(np.ones((4, 1)), np.ones(4), groups=np.zeros(3, dtype=int)))


def test_intervals_of_few_degrees_of_freedom_use_student():
    design = np.eye(5)[:, :1] + 1.0
    estimate = solve(linear_problem(design, np.arange(5.0)))
    low, high = estimate.interval("p0")
    assert (high - low) / 2 / estimate.std("p0") == pytest.approx(2.7764451)  # t, 4 degrees of freedom


def test_marginal_is_in_the_estimation_coordinate():
    estimate = solve(decay_problem(0))
    values, covariance = estimate.marginal(["k"])
    assert values[0] == pytest.approx(math.log(estimate.values["k"]))
    assert estimate.std("k") == pytest.approx(estimate.values["k"] * math.sqrt(covariance[0, 0]))


@pytest.mark.parametrize(
    ("ratio", "freedom", "unexplained"),
    [(1.4, 90, False), (1.5, 90, True), (1.09, 20000, False), (1.12, 20000, True)],
)
def test_chi2_is_unexplained_beyond_chance_and_ten_percent(ratio, freedom, unexplained):
    estimate = solve(linear_problem(np.random.default_rng(2).standard_normal((20, 3)), np.ones(20)))
    assert replace(estimate, chi2=ratio * freedom, degrees_of_freedom=freedom).unexplained is unexplained


def test_noise_alone_is_explained():
    """Chance raises chi2 above its limit in less than 1 % of all sets of 60 degrees of freedom."""
    chi2 = np.random.default_rng(3).chisquare(60, size=2000)
    estimate = solve(linear_problem(np.random.default_rng(2).standard_normal((20, 3)), np.ones(20)))
    flagged = [replace(estimate, chi2=float(c), degrees_of_freedom=60).unexplained for c in chi2]
    assert 0 < np.mean(flagged) < 0.01
