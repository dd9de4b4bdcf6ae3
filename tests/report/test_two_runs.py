"""The comparison of two runs says what chance allows it to say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from flexcal.estimation import Dropped, Estimate, Parameter, Parameters
from flexcal.files.formats import BLOCKS
from flexcal.report.layout.rendering import page_html
from flexcal.report.pages.run_comparison import comparison_page, comparison_verdict
from flexcal.report.results import Comparison, Run, parameter_changes
from flexcal.report.results.run_significance import mean_difference


def along_x(sizes: np.ndarray) -> np.ndarray:
    return np.stack([sizes, np.zeros_like(sizes), np.zeros_like(sizes)], axis=1)


def run(name: str, sizes: np.ndarray, *, places: int = 0, fresh: bool = True, **rest) -> Run:
    q = np.random.default_rng(places).normal(size=(len(sizes), 6))
    return Run(name, "verification", "ur5", q, q[:, :3], along_x(sizes), fresh, **rest)


def estimate(values: dict[str, float], covariance: np.ndarray, dropped: tuple[Dropped, ...] = ()) -> Estimate:
    parameters = Parameters([Parameter(name, "m", value) for name, value in values.items()])
    size = len(values)
    return Estimate(parameters, covariance, size, dropped, (True,) * size, 1.0, 1.0, 500, "converged", "", 3)


def test_as_many_points_as_stretches_give_the_t_tests_of_scipy(rng: np.random.Generator) -> None:
    a, b = rng.uniform(1, 2, 20), rng.uniform(1, 2.2, 20)
    paired = mean_difference(along_x(a), along_x(b), paired=True)
    expected = stats.ttest_rel(b, a).confidence_interval(0.95)
    np.testing.assert_allclose((paired.low, paired.high), (expected.low, expected.high), rtol=1e-9)
    apart = mean_difference(along_x(a), along_x(b[:15]), paired=False)
    expected = stats.ttest_ind(b[:15], a, equal_var=False).confidence_interval(0.95)
    np.testing.assert_allclose((apart.low, apart.high), (expected.low, expected.high), rtol=1e-9)


def test_neighbours_that_err_alike_widen_the_interval(rng: np.random.Generator) -> None:
    """400 numbers in runs of 20 equal ones are 20 numbers: a test on all of them would call one equal pair in two different."""
    wrong = naive = 0
    for _ in range(200):
        a, b = (np.repeat(rng.uniform(1, 2, 20), 20) for _ in range(2))
        wrong += mean_difference(along_x(a), along_x(b), paired=False).significant
        naive += stats.ttest_ind(a, b).pvalue < 0.05
    assert wrong <= 20 < 80 < naive


def test_one_point_says_nothing() -> None:
    found = mean_difference(along_x(np.array([1.0])), along_x(np.array([2.0])), paired=True)
    assert found.value == 1.0 and not found.significant
    page = comparison_page(Comparison(run("a", np.array([1e-4])), run("b", np.array([2e-4]))))
    assert "not significant" in page.verdict.headline and page.verdict.status == "care"


def test_scores_are_those_of_independent_estimates(rng: np.random.Generator) -> None:
    """Drawn again and again from their covariances, one score in twenty is beyond the bound, and the joint probability is even."""
    root = rng.normal(size=(8, 8))
    covariance = root @ root.T + 0.1 * np.eye(8)
    names = [f"joint_{k}.length_x" for k in range(8)]
    beyond, probabilities = 0, []
    for _ in range(400):
        pair = [
            estimate(
                dict(zip(names, rng.multivariate_normal(np.zeros(8), scale * covariance), strict=True)),
                scale * covariance,
            )
            for scale in (1.0, 0.3)
        ]
        found = parameter_changes(*pair)
        beyond += len(found.beyond)
        probabilities.append(found.probability)
    assert abs(beyond / 3200 - 0.05) < 0.025
    assert stats.kstest(probabilities, "uniform").pvalue > 1e-3


def test_combinations_of_different_parameters_are_not_compared() -> None:
    values = {"a.length_x": 1.0, "b.length_x": 2.0}
    first = estimate(values, np.eye(2), (Dropped("c.length_x", (("a.length_x", 1.0),)),))
    second = estimate({**values, "b.length_x": 9.0}, np.eye(2))
    found = parameter_changes(first, second)
    assert found.others == ("a.length_x",)
    (change,) = found.beyond
    assert change.name == "b.length_x" and change.score == pytest.approx(7 / np.sqrt(2))
    unseen = replace(second, identifiable=(True, False))
    assert parameter_changes(first, unseen).changes == ()


def test_the_better_run_is_named(rng: np.random.Generator) -> None:
    sizes = rng.uniform(1e-4, 2e-4, 40)
    better, worse = run("new", 0.5 * sizes), run("old", sizes)
    for pair in ((better, worse), (worse, better)):
        verdict = comparison_verdict(Comparison(*pair))
        assert (
            verdict.headline.startswith("new is more accurate than old by 0.07") and verdict.status == "good"
        )
    elsewhere = comparison_verdict(Comparison(better, replace(worse, q=worse.q + 1.0)))
    assert elsewhere.status == "care" and "No: a run with easier points" in elsewhere.checks[1].answer
    fitted = comparison_verdict(Comparison(replace(better, fresh=False), worse))
    assert fitted.status == "care" and "Not in new" in fitted.checks[0].answer


def test_shared_measurements_are_no_independent_estimates() -> None:
    estimates = {"calibration": estimate({"a.length_x": 1.0}, np.eye(1))}
    sizes = np.full(30, 1e-4)
    one = run("a", sizes, estimates=estimates, data={"grid.csv": "12ab"})
    same = comparison_page(Comparison(one, replace(one, name="b", data={"renamed.csv": "12ab"})))
    assert "Both runs used grid.csv" in same.sections[1].lead
    apart = comparison_page(Comparison(one, replace(one, name="b", data={"grid.csv": "34cd"})))
    assert "share no measurement" in apart.sections[1].lead


def test_every_block_of_the_estimates_is_compared() -> None:
    """A payload 0.3 kg heavier by ten of its joint standard deviations."""
    sides = [
        {block: estimate({"payload.mass": mass}, np.array([[4.5e-4]])) for block in BLOCKS}
        for mass in (6.0, 6.3)
    ]
    sizes = np.full(30, 1e-4)
    found = Comparison(*(run(name, sizes, estimates=side) for name, side in zip("ab", sides, strict=True)))
    assert tuple(found.changes) == BLOCKS
    (change,) = found.document()["parameters"]["payload"]["changed"]  # type: ignore[index]
    assert change["name"] == "payload.mass" and change["score"] == pytest.approx(10.0)
    assert "table-payload" in page_html(comparison_page(found))
