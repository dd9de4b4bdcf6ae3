"""Two groups of units among many quantities: found where they are, and seldom where they are not."""

from __future__ import annotations

import numpy as np
import pytest
from over_seeds import over_seeds

from flexcal.fleet import two_groups
from flexcal.fleet.grouping import least_within

LEVEL = 0.05


def standardised(values: np.ndarray) -> np.ndarray:
    return (values - values.mean(axis=0)) / values.std(axis=0)


def two_batches(count: int, second: int, apart: float, rng: np.random.Generator) -> np.ndarray:
    """Units of two normal groups, whose means are `apart` standard deviations, in 30 quantities; the last ones are the `second` group."""
    shift = rng.standard_normal(30)
    values = rng.standard_normal((count, 30))
    values[count - second :] += apart * shift / np.linalg.norm(shift)
    return standardised(values)


def test_the_least_variance_within_is_that_of_all_cuts() -> None:
    rng = np.random.default_rng(1)
    for count in (6, 9, 14):
        places = rng.standard_normal(count)
        ordered = np.sort(places)
        cuts = {
            k: np.sum((ordered[:k] - ordered[:k].mean()) ** 2)
            + np.sum((ordered[k:] - ordered[k:].mean()) ** 2)
            for k in range(3, count - 2)
        }
        ratio, size = least_within(places)
        best = min(cuts, key=lambda k: cuts[k])
        assert size == best
        assert ratio == pytest.approx(cuts[best] / np.sum((places - places.mean()) ** 2))


@pytest.mark.parametrize(("count", "second"), [(6, 3), (8, 3), (15, 5), (40, 20)])
def test_groups_far_apart_are_found_with_their_units(count: int, second: int) -> None:
    rng = np.random.default_rng(2)
    values = two_batches(count, second, 30.0, rng)
    order = rng.permutation(count)
    found = two_groups(values[order])
    assert found is not None and found.probability <= LEVEL
    assert set(order[found.second].tolist()) in (
        set(range(count - second, count)),
        set(range(count - second)),
    )
    assert 8 < found.separation < 60


def test_groups_that_differ_in_one_quantity_are_found() -> None:
    values = np.random.default_rng(4).standard_normal((14, 30))
    values[:5, 17] += 20
    found = two_groups(standardised(values))
    assert found is not None and found.probability <= LEVEL
    assert np.flatnonzero(found.second).tolist() == [0, 1, 2, 3, 4]


def test_outlying_units_are_no_group() -> None:
    rng = np.random.default_rng(3)
    for outlying in (1, 2):
        values = rng.standard_normal((15, 30))
        values[:outlying] += 20 * rng.standard_normal((1, 30))
        found = two_groups(standardised(values))
        assert found is not None and found.probability > LEVEL
    assert two_groups(rng.standard_normal((5, 30))) is None


def alarms(seed: int, count: int) -> list[bool]:
    """Whether groups are said to be where there are none: normal units, correlated ones, of heavy tails each quantity for itself and all of
    a unit together, and uniform along one direction.
    """
    rng = np.random.default_rng([seed, count])
    normal = rng.standard_normal((count, 30))
    fleets = [
        normal,
        normal[:, :1],
        normal + rng.standard_normal((count, 2)) @ (2 * rng.standard_normal((2, 30))),
        rng.standard_t(4, (count, 30)),
        rng.standard_t(4, (count, 1)),
        rng.standard_normal((count, 30)) / np.sqrt(rng.chisquare(4, (count, 1)) / 4),
        np.concatenate([rng.uniform(-10, 10, (count, 1)), normal], axis=1),
    ]
    found = [two_groups(standardised(values)) for values in fleets]
    return [item is not None and item.probability <= LEVEL for item in found]


def test_seldom_are_groups_said_to_be_where_there_are_none() -> None:
    """At 5 %, of 280 fleets in which 14 are expected at most."""
    assert np.sum([alarms(seed, 10) for seed in range(40)]) <= 20


@pytest.mark.slow
@pytest.mark.parametrize("count", [6, 12, 30, 60])
def test_false_alarms_keep_their_rate(count: int) -> None:
    """5 % is stated; each of 7 populations in 200 fleets, whose rate scatters by 1.5 %."""
    shares = np.mean(over_seeds(alarms, range(200), count), axis=0)
    print(count, shares)
    assert np.all(shares <= 0.08) and np.mean(shares) <= 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "second", "apart"), [(6, 3, 30), (8, 4, 16), (12, 4, 14), (20, 5, 11), (40, 10, 9)]
)
def test_power(count: int, second: int, apart: float) -> None:
    rng = np.random.default_rng(count)
    found = [two_groups(two_batches(count, second, apart, rng)) for _ in range(60)]
    assert np.mean([item is not None and item.probability <= LEVEL for item in found]) >= 0.8
