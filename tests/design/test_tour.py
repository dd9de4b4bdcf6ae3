from itertools import permutations

import numpy as np
import pytest

from flexcal.design.poses.travelling_salesman import shortest_path


def _length(cost, order):
    return cost[order[:-1], order[1:]].sum()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 7])
def test_few_places_against_every_order(count, rng):
    for number in range(8):
        places = rng.uniform(0, 1, (count, 3))
        cost = np.abs(places[:, None] - places).max(axis=2)
        if number % 2:  # not even a metric
            cost = np.triu(rng.uniform(0, 1, (count, count)), 1)
            cost += cost.T
        order = shortest_path(cost)
        assert sorted(order) == list(range(count))
        least = min(_length(cost, np.array(way)) for way in permutations(range(count)))
        assert _length(cost, order) == pytest.approx(least, abs=1e-12)


def test_places_on_a_line_are_taken_from_one_end_to_the_other(rng):
    places = rng.uniform(0, 1, 60)
    order = shortest_path(np.abs(places[:, None] - places))
    assert np.all(np.diff(places[order]) > 0) or np.all(np.diff(places[order]) < 0)


def test_many_places_near_the_expected_shortest_way(rng):
    """Random places in a unit square: 0.7124 √(N A) for many of them (Johnson & McGeoch 1996), some percent more for few."""
    lengths = []
    for _ in range(4):
        places = rng.uniform(0, 1, (60, 2))
        cost = np.linalg.norm(places[:, None] - places, axis=2)
        lengths.append(_length(cost, shortest_path(cost)))
    assert np.mean(lengths) < 1.1 * 0.7124 * np.sqrt(60)


def test_a_given_order_is_only_improved(rng):
    places = rng.uniform(0, 1, (30, 2))
    cost = np.linalg.norm(places[:, None] - places, axis=2)
    start = rng.permutation(30)
    assert _length(cost, shortest_path(cost, start)) < _length(cost, start)
    best = shortest_path(cost)
    assert _length(cost, shortest_path(cost, best)) <= _length(cost, best) + 1e-12
