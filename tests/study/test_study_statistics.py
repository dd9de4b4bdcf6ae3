"""Statistics of studies against other programs, closed forms and drawn numbers whose distribution is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import polars
import pytest
from scipy.stats import binomtest, ttest_rel

from flexcal.report.layout import Check, write_page
from flexcal.report.pages import StudyReport, study_page
from flexcal.report.results import (
    StudyTable,
    binomial_interval,
    effect_probability,
    effect_sentence,
    study_statistics,
)


@pytest.mark.parametrize(("inside", "count"), [(0, 7), (7, 7), (93, 100), (1, 2), (1900, 2000)])
def test_the_binomial_interval_is_that_of_scipy(inside: int, count: int) -> None:
    expected = binomtest(inside, count).proportion_ci(0.95, "exact")
    assert binomial_interval(inside, count) == pytest.approx((expected.low, expected.high), abs=1e-12)


def table(columns: dict[str, object], options: tuple[str, ...] = (), *, truth: bool = True) -> StudyTable:
    count = len(next(iter(columns.values())))  # type: ignore[arg-type]
    none = dict.fromkeys(("error", "error_code"), [None] * count)
    frame = polars.DataFrame(
        {"number": range(count), "resample": [""] * count, "seconds": [0.1] * count} | none | columns
    )
    return StudyTable(frame, options, "verification", truth)


def intervals(errors: np.ndarray, std: float) -> dict[str, np.ndarray]:
    columns = {}
    for k, error in enumerate(errors.T):
        ends = {
            "estimate": error,
            "std": np.full(len(error), std),
            "low": error - 1.96 * std,
            "high": error + 1.96 * std,
        }
        columns |= {
            f"p{k}.{name}": values for name, values in {**ends, "truth": np.zeros(len(error))}.items()
        }
    return columns


def test_coverage_of_intervals_that_are_right_and_of_those_that_are_too_small() -> None:
    rng = np.random.default_rng(4)
    errors = rng.standard_normal((2000, 3))
    right = study_statistics(table(intervals(errors, 1.0)))["coverage"]
    assert right["low"] < 0.95 < right["high"] and right["tasks"] == 2000
    small = study_statistics(table(intervals(errors, 0.5)))["coverage"]
    assert small["share"] == pytest.approx(0.6729, abs=0.015) and small["high"] < 0.95  # 2 Φ(0.98) − 1
    assert set(small["parameters"]) == {"p0", "p1", "p2"}
    assert right["ratio"] == pytest.approx(1, abs=0.05) and small["ratio"] == pytest.approx(
        2 * right["ratio"]
    )


def test_the_interval_of_the_share_of_all_knows_that_those_of_a_task_are_not_independent() -> None:
    """Ten parameters with one common error tell as much as one."""
    error = np.random.default_rng(5).standard_normal((400, 1))
    one = study_statistics(table(intervals(error, 1.0)))["coverage"]
    ten = study_statistics(table(intervals(np.repeat(error, 10, axis=1), 1.0)))["coverage"]
    assert ten["high"] - ten["low"] == pytest.approx(one["high"] - one["low"])


def test_tasks_of_one_seed_tell_as_much_of_coverage_as_one() -> None:
    errors = np.random.default_rng(7).standard_normal((40, 5))
    columns = intervals(errors, 1.0) | {"seed": np.arange(40)}
    once = study_statistics(table(columns))["coverage"]
    often = study_statistics(table({name: np.tile(values, 4) for name, values in columns.items()}))[
        "coverage"
    ]
    assert [often[key] for key in ("low", "high")] == pytest.approx(
        [once[key] for key in ("low", "high")], abs=3e-3
    )
    single = often["parameters"]["p0"]
    assert single["tasks"] == 160 and single["high"] - single["low"] >= 0.8 * (
        once["parameters"]["p0"]["high"] - once["parameters"]["p0"]["low"]
    )


def test_intervals_that_are_right_are_seldom_called_wrong() -> None:
    """Twelve seeds with three options each, whose errors are alike: 95 % lies outside the interval of the share in about 5 % of studies."""
    rng = np.random.default_rng(8)
    outside = []
    for _ in range(100):
        common = np.repeat(rng.standard_normal((12, 15)), 3, axis=0)
        errors = np.sqrt(0.9) * common + np.sqrt(0.1) * rng.standard_normal(common.shape)
        covered = study_statistics(table(intervals(errors, 1.0) | {"seed": np.repeat(np.arange(12), 3)}))[
            "coverage"
        ]
        outside.append(not covered["low"] <= 0.95 <= covered["high"])
    assert np.mean(outside) < 0.1


def test_few_tasks_say_little_even_where_all_intervals_hold_the_truth() -> None:
    covered = study_statistics(table(intervals(np.zeros((3, 25)), 1.0)))["coverage"]
    assert covered["share"] == 1.0 and covered["low"] < 0.1 and covered["high"] == 1.0


def test_the_share_of_an_option_is_that_of_the_variance_it_makes() -> None:
    rng = np.random.default_rng(6)
    count = 6000
    poses, cell = rng.choice([10, 20, 40], count), rng.choice(["a", "b <script>"], count)
    drawn = rng.uniform(0, 1, count)
    log = 0.5 * np.log(poses) + 2.0 * drawn + 0.4 * rng.standard_normal(count)
    total = 0.25 * np.var(np.log([10, 20, 40])) + 4 / 12 + 0.16
    columns = {
        "option.poses": poses,
        "option.cell": cell,
        "option.drawn": drawn,
        "verification.p90_mm": np.exp(log),
    }
    for name in ("mean_mm", "max_mm"):
        columns[f"verification.{name}"] = np.exp(log)
    studied = table(columns, ("option.poses", "option.cell", "option.drawn"), truth=False)
    found = {item["option"]: item for item in study_statistics(studied)["effects"]}
    assert found["poses"]["share"] == pytest.approx(0.25 * np.var(np.log([10, 20, 40])) / total, abs=0.03)
    assert found["drawn"]["share"] == pytest.approx((1 - 1 / 36) * 4 / 12 / total, abs=0.03)  # of six bins
    assert found["cell"]["share"] < 0.003
    assert [level["value"] for level in found["poses"]["levels"]] == [10, 20, 40]


def effects(
    seeds: int,
    cells: Sequence[dict[str, float]],
    mean: Callable[[dict[str, float]], float],
    rng: np.random.Generator,
) -> dict[str, dict[str, Any]]:
    """Effects of the options of `cells`, each run with every seed: seeds scatter the logarithm by 0.5, and tasks by 0.2."""
    of_seed = rng.normal(0, 0.5, seeds)
    rows = [(seed, cell) for cell in cells for seed in range(seeds)]
    errors = np.exp([mean(cell) + of_seed[seed] + rng.normal(0, 0.2) for seed, cell in rows])
    columns = {f"option.{name}": [cell[name] for _, cell in rows] for name in cells[0]}
    studied = table(
        {"seed": [seed for seed, _ in rows], "verification.p90_mm": errors, **columns},
        tuple(columns),
        truth=False,
    )
    return {item["option"]: item for item in study_statistics(studied)["effects"]}


GRID = [{"poses": poses, "noise": noise} for poses in (10, 20) for noise in (1, 2, 3)]


def drawn_cells(count: int, rng: np.random.Generator) -> list[dict[str, float]]:
    return [{"poses": poses, "noise": noise} for poses, noise in rng.uniform(0, 1, (count, 2))]


@pytest.mark.parametrize(("seeds", "draws"), [(2, 0), (3, 0), (8, 0), (4, 9), (3, 24)])
def test_options_without_effect_are_seldom_said_to_have_one(seeds: int, draws: int) -> None:
    rng = np.random.default_rng(11)
    alarms = 0
    for _ in range(60):
        found = effects(seeds, drawn_cells(draws, rng) if draws else GRID, lambda _: 0.0, rng)
        alarms += any(not item["by_chance"] for item in found.values())
    assert alarms <= 8  # 5 % of 60 are 3; more than 8 have a probability of 0.3 %


def test_an_effect_is_that_of_its_own_option_only() -> None:
    """Draws of two options of which one has an effect, in as many studies of a grid and of draws."""
    rng = np.random.default_rng(12)
    found = [effects(4, GRID, lambda cell: cell["noise"], rng) for _ in range(20)]
    found += [effects(4, drawn_cells(20, rng), lambda cell: 4.0 * cell["noise"], rng) for _ in range(20)]
    assert all(not item["noise"]["by_chance"] for item in found)
    assert sum(not item["poses"]["by_chance"] for item in found) <= 4


def test_an_interaction_is_an_effect_of_the_options_together() -> None:
    cells = [{"poses": a, "noise": b} for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    found = effects(6, cells, lambda cell: 2.0 * cell["poses"] * cell["noise"], np.random.default_rng(13))
    assert found["poses"]["by_chance"] and found["noise"]["by_chance"]
    together = found["all options together"]
    assert not together["by_chance"] and together["share"] > 0.8


@pytest.mark.parametrize(("seeds", "draws"), [(1, 0), (1, 30), (6, 5)])
def test_one_seed_or_a_few_draws_do_not_tell_an_effect_from_chance(seeds: int, draws: int) -> None:
    """Five draws of two options: whatever one explains the other explains too."""
    rng = np.random.default_rng(14)
    found = effects(seeds, drawn_cells(draws, rng) if draws else GRID, lambda cell: 9.0 * cell["noise"], rng)
    assert all(item["p"] is None and item["by_chance"] for item in found.values())
    assert "too few" in effect_sentence(found["noise"])


def test_the_probability_of_an_effect_is_that_of_the_analysis_of_variance() -> None:
    """Two levels and n seeds: the paired t-test. Failed tasks leave out their seed."""
    rng = np.random.default_rng(15)
    first, second = rng.normal(0, 1, (2, 9))
    labels, seeds = np.repeat([0, 1], 9), np.tile(np.arange(9), 2)
    values = np.concatenate([first, second])
    expected = ttest_rel(first, second).pvalue
    assert effect_probability(values, labels, labels, seeds) == pytest.approx(expected, rel=1e-9)
    kept = np.arange(18) != 4
    expected = ttest_rel(np.delete(first, 4), np.delete(second, 4)).pvalue
    assert effect_probability(values[kept], labels[kept], labels[kept], seeds[kept]) == pytest.approx(
        expected, rel=1e-9
    )
    alike = np.tile(first, 2)
    assert effect_probability(alike, labels, labels, seeds) == 1.0


def test_a_jackknife_of_means_gives_their_standard_error() -> None:
    """Means of all but one of n numbers: exactly s / √n."""
    values = np.random.default_rng(7).standard_normal(12)
    means = [values.mean(), *(np.delete(values, k).mean() for k in range(12))]
    names = ["all", *(f"without {k}" for k in range(12))]
    std = values.std(ddof=1) / np.sqrt(12)
    studied = table({"resample": names, "a.estimate": means, "a.std": [std] * 13}, truth=False)
    block = study_statistics(studied)["resampling"]
    assert block["kind"] == "jackknife" and block["parameters"]["a"]["ratio"] == pytest.approx(1.0, rel=1e-12)
    names = ["all", *(f"bootstrap {k}" for k in range(12))]
    block = study_statistics(
        table({"resample": names, "a.estimate": means, "a.std": [1.0] * 13}, truth=False)
    )["resampling"]
    assert block["parameters"]["a"]["spread"] == pytest.approx(np.std(means[1:], ddof=1))


def jackknife_of_lines(
    groups: int, rows: int, unknowns: int, rng: np.random.Generator, *, far: float = 1.0
) -> dict[str, Any]:
    """Jackknife of a linear least-squares problem with normal errors, its last group `far` times as far out as the others."""
    matrix, group = rng.standard_normal((rows, unknowns)), np.arange(rows) % groups
    matrix[group == groups - 1] *= far
    right = rng.standard_normal(rows)
    estimates = [
        np.linalg.lstsq(matrix[group != left], right[group != left])[0] for left in (-1, *range(groups))
    ]
    residual = right - matrix @ estimates[0]
    std = np.sqrt(residual @ residual / (rows - unknowns) * np.diag(np.linalg.inv(matrix.T @ matrix)))
    sizes = np.array([rows, *(int((group != left).sum()) for left in range(groups))])
    columns = {"resample": ["all", *(f"without {k}" for k in range(groups))], "freedom": sizes - unknowns}
    columns["rank"] = np.full(groups + 1, unknowns)
    for k in range(unknowns):
        columns |= {f"p{k}.estimate": [x[k] for x in estimates], f"p{k}.std": np.full(groups + 1, std[k])}
    return study_statistics(table(columns, truth=False))["resampling"]


@pytest.mark.parametrize(("groups", "rows"), [(10, 60), (10, 120), (20, 60)])
def test_a_jackknife_of_sound_data_spreads_as_expected(groups: int, rows: int) -> None:
    """27 parameters of few measurements: the spread alone would call the stated standard deviations too small."""
    rng = np.random.default_rng(groups + rows)
    blocks = [jackknife_of_lines(groups, rows, 27, rng) for _ in range(30)]
    ratios = [block["ratio"] / block["expected"] for block in blocks]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)
    assert sum(bool(block["surely_larger"]) for block in blocks) <= 1


def test_one_group_of_great_influence_is_no_spread_beyond_chance() -> None:
    rng = np.random.default_rng(17)
    blocks = [jackknife_of_lines(10, 120, 20, rng, far=3.0) for _ in range(60)]
    assert (
        sum(bool(block["surely_larger"]) for block in blocks) <= 4
    )  # by chi-square of nine degrees of freedom 12


def test_fewer_than_eight_data_sets_are_not_judged() -> None:
    columns = spreads([9.0] * 5, 6, np.random.default_rng(18))
    assert [check.status for check in checks_of_resamples(columns, 6)] == ["good", "good"]
    studied = table({"resample": ["all", *(f"bootstrap {k}" for k in range(6))], **columns}, truth=False)
    assert study_statistics(studied)["resampling"]["surely_larger"] == []


def checks_of_resamples(columns: dict[str, object], count: int) -> tuple[Check, ...]:
    """Checks of the page of a study of resampled data."""
    names = ["all", *(f"bootstrap {k}" for k in range(count))]
    studied = table({"resample": names, **columns}, truth=False)
    results = {
        "study": "calibrate",
        "name": "s",
        "error": "fit",
        "has_truth": False,
        "command": "",
        "provenance": {},
    }
    results |= {"tasks": {"total": count + 1, "done": count + 1, "failed": 0}, **study_statistics(studied)}
    return study_page(StudyReport(results, studied)).verdict.checks


def spreads(factors: Sequence[float], count: int, rng: np.random.Generator) -> dict[str, object]:
    """Estimates of parameters that spread by so many times what is stated."""
    columns: dict[str, object] = {}
    for k, factor in enumerate(factors):
        columns |= {
            f"p{k}.estimate": factor * rng.standard_normal(count + 1),
            f"p{k}.std": np.ones(count + 1),
        }
    return columns


def test_one_parameter_that_surely_spreads_more_is_said_beside_a_good_median() -> None:
    rng = np.random.default_rng(9)
    *_, check = checks_of_resamples(spreads([1.0] * 30 + [20.0], 12, rng), 12)
    assert check.status == "care" and "but that of p30" in check.answer and "p1 " not in check.answer
    told = [checks_of_resamples(spreads([1.0] * 31, 12, rng), 12)[-1].status for _ in range(60)]
    assert told.count("good") >= 58
    *_, check = checks_of_resamples(
        {f"scatter.{n}": v for n, v in [("a.estimate", 20 * rng.standard_normal(13)), ("a.std", np.ones(13))]}
        | spreads([1.0] * 9, 12, rng),
        12,
    )
    assert check.status == "good"  # how the scatter is shared among its components is chance


@pytest.mark.parametrize(("factor", "status"), [(1.0, "good"), (3.0, "bad"), (0.25, "good")])
def test_a_spread_unlike_the_stated_one_is_said(factor: float, status: str) -> None:
    checks = checks_of_resamples(spreads([factor] * 9, 60, np.random.default_rng(8)), 60)
    assert [check.status for check in checks] == ["good", "good", status]
    assert ("too small for these data" in checks[-1].answer) == (factor > 1)
    assert ("too large" in checks[-1].answer) is False  # errors that resamples share are in none of them


def judged(studied: StudyTable) -> tuple[dict[str, Any], Check]:
    """Coverage of a study of virtual calibrations, and what the page says of it."""
    results: dict[str, Any] = {
        "study": "virtual_calibration",
        "name": "s",
        "error": "verification",
        "has_truth": True,
    }
    results |= {"command": "", "provenance": {}, **study_statistics(studied)}
    results |= {"tasks": {"total": len(studied), "done": len(studied), "failed": 0}}
    return results["coverage"], study_page(StudyReport(results, studied)).verdict.checks[-1]


@pytest.mark.parametrize(
    ("std", "status", "said"),
    [
        (1.0, "good", "."),
        (1.06, "good", "a little too large"),
        (1.3, "care", "are too large"),
        (0.7, "bad", "are too small"),
    ],
)
def test_a_share_that_surely_but_hardly_differs_from_the_stated_one_is_no_fault(
    std: float, status: str, said: str
) -> None:
    """Errors of standard deviation 1: 95 % of intervals for 1.06 hold 96.2 % of the truth."""
    errors = np.random.default_rng(9).standard_normal((3000, 4))
    studied = table(intervals(errors, std))
    _, check = judged(studied)
    assert check.status == status and said in check.answer and "are few" not in check.answer
    if std != 1.0:
        times = float(check.answer.split(" times the stated")[0].split()[-1])
        assert times == pytest.approx(1 / std, rel=0.03)


def test_eight_seeds_do_not_show_that_uncertainties_are_too_large() -> None:
    errors = np.zeros((8, 50))
    errors[:4, 0] = 3.0  # half of the tasks have one interval of fifty that does not hold the truth
    studied = table(intervals(errors, 1.0) | {"seed": np.arange(8)})
    covered, check = judged(studied)
    assert covered["low"] > 0.95 and covered["seeds"] == 8  # the interval itself would exclude 95 %
    assert (
        check.status == "unknown" and "may be too large" in check.answer and "8 seeds are few" in check.answer
    )


@pytest.mark.parametrize("seeds", [1, 2, 3])
def test_a_few_seeds_do_not_show_that_intervals_are_right(seeds: int) -> None:
    """All intervals hold the truth; nothing is known of robots that no seed drew."""
    covered, check = judged(table(intervals(np.zeros((seeds, 40)), 1.0) | {"seed": np.arange(seeds)}))
    assert covered["low"] < 0.88 and check.status == "unknown" and "too few to tell" in check.answer


@pytest.mark.parametrize(("count", "told"), [(2, "in all of the tasks"), (200, "in 95 % of the tasks")])
def test_the_range_of_the_errors_holds_as_many_tasks_as_it_says(count: int, told: str) -> None:
    errors = np.random.default_rng(16).uniform(0.1, 0.2, count)
    studied = table({f"verification.{name}": errors for name in ("mean_mm", "p90_mm", "max_mm")}, truth=False)
    item = study_statistics(studied)["errors"]["verification"]["p90_mm"]
    assert np.mean((item["low"] <= errors) & (errors <= item["high"])) >= (1.0 if count < 40 else 0.95)
    results = {"study": "calibrate", "name": "s", "error": "verification", "has_truth": False, "command": ""}
    results |= {
        "provenance": {},
        "tasks": {"total": count, "done": count, "failed": 0},
        **study_statistics(studied),
    }
    assert told in study_page(StudyReport(results, studied)).verdict.facts[0].detail


def test_names_and_messages_are_text_in_the_page(tmp_path) -> None:
    errors = {f"verification.{name}": [0.1, None, 0.3] for name in ("mean_mm", "p90_mm", "max_mm")}
    failed = {"error": [None, "a <script>alert(1)</script>.", None], "error_code": [None, "E-CAL-900", None]}
    studied = table(
        {"option.terms": ["a", "b <i>", "b <i>"]} | errors | failed, ("option.terms",), truth=False
    )
    results = {
        "study": "virtual_calibration",
        "name": "<b>",
        "error": "verification",
        "has_truth": False,
        "command": "",
        "provenance": {},
    }
    results |= {"tasks": {"total": 4, "done": 3, "failed": 1}, **study_statistics(studied)}
    write_page(tmp_path / "page.html", study_page(StudyReport(results, studied)))
    page = (tmp_path / "page.html").read_text()
    assert "<script>alert(1)" not in page and "b <i>" not in page.split("<body")[1].split("<script")[0]
    assert "E-CAL-900" in page and "1 have not" in page
