"""Statistics of many robots: closed forms, other libraries' numbers, and error rates over simulated fleets."""

from __future__ import annotations

import numpy as np
import pytest
from over_seeds import over_seeds
from scipy import stats

from flexcal.fleet import Course, crossing, holm, moderated_trends, outlying, random_effects


def test_holm_by_hand() -> None:
    """Holm (1979): sorted p-values times N, N − 1, …, never decreasing."""
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    assert len(holm([])) == 0


def test_random_effects_of_exact_values_are_mean_and_standard_deviation() -> None:
    values = np.array([1.0, 2.0, 4.0, 8.0])
    found = random_effects(values, np.zeros(4))
    assert found.mean == pytest.approx(values.mean())
    assert found.spread == pytest.approx(values.std(ddof=1))
    low, high = np.sqrt(3 * values.var(ddof=1) / stats.chi2.ppf([0.975, 0.025], 3))
    assert (found.spread_low, found.spread_high) == pytest.approx((low, high))


def test_random_effects_without_difference_between_units() -> None:
    """Values nearer to each other than their uncertainty: the spread is zero, the mean weighted by the variances."""
    found = random_effects(np.array([1.0, 1.1, 0.9]), np.array([1.0, 2.0, 1.0]))
    assert found.spread == 0.0
    assert found.mean == pytest.approx((1.0 + 1.1 / 4 + 0.9) / 2.25)


def test_spread_interval_covers() -> None:
    rng = np.random.default_rng(4)
    std = rng.uniform(0.2, 2.0, 12)
    inside = 0
    for _ in range(300):
        found = random_effects(rng.standard_normal(12) + std * rng.standard_normal(12), std)
        inside += found.spread_low <= 1.0 <= found.spread_high
    assert 0.91 <= inside / 300 <= 0.985


def test_single_course_is_the_ordinary_t_test() -> None:
    rng = np.random.default_rng(1)
    time, values = np.sort(rng.uniform(0, 3, 6)), rng.standard_normal(6)
    (trend,) = moderated_trends([Course(time, values, np.full(6, 0.1))])
    known = stats.linregress(time, values)
    assert trend.slope == pytest.approx(known.slope)
    assert trend.probability == pytest.approx(known.pvalue)
    assert trend.at(0.0) == pytest.approx(known.intercept)
    half = stats.t.ppf(0.975, 4) * known.stderr
    assert trend.slope_interval(0.95) == pytest.approx((known.slope - half, known.slope + half))


def test_crossing_is_where_the_band_holds_the_limit() -> None:
    """Fieller's interval of the time, against the ordinary confidence band of a regression line (scipy's covariance)."""
    time = np.arange(5.0)
    values = np.array([1.0, 1.9, 3.2, 3.9, 5.1])
    (trend,) = moderated_trends([Course(time, values, np.full(5, 1.0))])
    found = crossing(trend, 9.0)
    assert found is not None
    known = stats.linregress(time, values)
    assert found.time == pytest.approx((9.0 - known.intercept) / known.slope)
    quantile = stats.t.ppf(0.975, 3)
    for end, sign in ((found.low, 1), (found.high, -1)):
        # the standard error of the mean of five values about the line is that of the slope times √(Σ(t − 2)² / 5)
        half = quantile * known.stderr * np.hypot(end - 2.0, np.sqrt(10 / 5))
        assert known.intercept + known.slope * end + sign * half == pytest.approx(9.0)
    assert crossing(trend, 0.0) is not None
    (flat,) = moderated_trends([Course(time, np.array([1.0, 1.2, 0.9, 1.1, 1.0]), np.full(5, 1.0))])
    assert crossing(flat, 9.0) is None


def test_outlying_units_do_not_hide_each_other() -> None:
    rng = np.random.default_rng(0)
    values = rng.standard_normal(40)
    values[[3, 7, 11]] += 12.0
    assert {item.number for item in outlying(values, np.full(40, 0.1), 20, 0.05)} == {3, 7, 11}
    assert outlying(values[:4], np.full(4, 0.1), 1, 0.05) == ()


def test_large_deviation_of_an_uncertain_measurement_is_not_outlying() -> None:
    rng = np.random.default_rng(0)
    values, std = rng.standard_normal(30), np.full(30, 0.1)
    values[5] = 12.0
    assert [item.number for item in outlying(values, std, 20, 0.05)] == [5]
    std[5] = 8.0
    assert outlying(values, std, 20, 0.05) == ()


def alarms(
    rng: np.random.Generator, robots: int, visits: int, scatter: float, growth: float = 0.0
) -> np.ndarray:
    """Which robots are named in a fleet whose standard deviations differ by a factor exp(scatter · N(0, 1)); `growth` of the first, in
    standard deviations a visit.
    """
    courses = []
    for robot in range(robots):
        noise = np.exp(scatter * rng.standard_normal()) * rng.standard_normal(visits)
        drift = growth * np.arange(visits) if robot == 0 else 0.0
        courses.append(Course(np.arange(visits) / 2, noise + drift, np.ones(visits), "one"))
    return holm([trend.probability for trend in moderated_trends(courses)]) <= 0.05


@pytest.mark.parametrize(
    ("robots", "visits", "scatter"), [(1, 4, 0.0), (3, 4, 0.5), (20, 3, 0.0), (20, 4, 0.5)]
)
def test_fleets_without_drift_are_seldom_accused(robots: int, visits: int, scatter: float) -> None:
    """5 % is promised; of 200 fleets 19 or more have a probability of 0.4 % then."""
    rng = np.random.default_rng(7)
    assert sum(alarms(rng, robots, visits, scatter).any() for _ in range(200)) < 19


def test_a_drifting_robot_is_found() -> None:
    rng = np.random.default_rng(8)
    assert np.mean([alarms(rng, 30, 6, 0.2, growth=3.0)[0] for _ in range(40)]) > 0.9


def any_alarm(seed: int, robots: int, visits: int, scatter: float) -> bool:
    return bool(alarms(np.random.default_rng([9, seed]), robots, visits, scatter).any())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robots", "visits", "scatter"), [(100, 3, 0.0), (100, 4, 0.3), (100, 4, 0.6), (30, 5, 0.4), (8, 4, 0.4)]
)
def test_rate_of_false_alarms_over_fleets(robots: int, visits: int, scatter: float) -> None:
    share = np.mean(over_seeds(any_alarm, range(400), robots, visits, scatter))
    print(f"{robots} robots, {visits} visits, scatter {scatter}: {100 * share:.2f} % of 400 fleets")
    assert share <= 0.075


def test_fleets_of_one_distribution_have_few_outliers() -> None:
    rng = np.random.default_rng(10)
    std = rng.uniform(0.1, 1.0, 15)
    found = 0
    for _ in range(150):
        found += any(
            outlying(rng.standard_normal(15) + std * rng.standard_normal(15), std, 10, 0.05)
            for _ in range(10)
        )
    assert found < 16  # 5 % are 7.5; as many as 16 have a probability of 0.4 %
