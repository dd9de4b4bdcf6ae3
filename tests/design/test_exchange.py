from itertools import combinations

import numpy as np
import pytest
from refusals import refused

from flexcal.design.optimality import DOptimal, SpectralCriterion, TraceOptimal, exchange, greedy
from flexcal.design.optimality.rank_updates import RankUpdates
from flexcal.estimation import Parameter, Parameters, Sensitivity

WEIGHT = np.diag([1.0, 5.0, 0.2, 2.0]) + 0.1
TINY = [DOptimal(), TraceOptimal(WEIGHT, "c"), *map(SpectralCriterion, ("E", "O1", "O2", "O4", "O5"))]


def _sensitivity(rng, candidates, rows, size, prior=0.0):
    jacobian = rng.normal(size=(candidates, rows, size)) * np.geomspace(1, 30, size)
    return Sensitivity(
        jacobian, Parameters(Parameter(f"p{i}", "1", 0.0) for i in range(size)), prior * np.eye(size)
    )


def _merit(sensitivity, chosen, criterion):
    rows = sensitivity.jacobian[list(chosen)].reshape(-1, len(sensitivity.parameters))
    prior = sensitivity.prior_information if criterion.uses_prior else 0.0
    return criterion.merit(rows.T @ rows + prior)


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("criterion", TINY, ids=lambda c: c.name)
def test_no_single_swap_is_better_and_mostly_it_is_the_best_of_all(criterion, rows, rng):
    best = 0
    for _ in range(8):
        sensitivity = _sensitivity(rng, 10, rows, 4, prior=1e-3)
        found = exchange(sensitivity, 5, criterion)
        assert len(set(found.chosen)) == 5
        assert found.merit == pytest.approx(_merit(sensitivity, found.chosen, criterion), rel=1e-9)
        for place in range(5):
            for other in set(range(10)) - set(found.chosen):
                swapped = [*np.delete(found.chosen, place), other]
                assert _merit(sensitivity, swapped, criterion) <= found.merit + 1e-7 * abs(found.merit)
        top = max(_merit(sensitivity, c, criterion) for c in combinations(range(10), 5))
        best += found.merit >= top - 1e-7 * abs(top)
    assert best >= 5


@pytest.mark.parametrize("rows", [1, 2, 3, 4])
@pytest.mark.parametrize("criterion", [DOptimal(), TraceOptimal(WEIGHT, "c")], ids=lambda c: c.name)
def test_updates_against_recomputation(criterion, rows, rng):
    sensitivity = _sensitivity(rng, 30, rows, 4, prior=0.5)
    state = RankUpdates(sensitivity, criterion)
    members = list(range(8))
    state.rebuild(members)
    for _ in range(40):
        if rng.random() < 0.5 and len(members) > 4:
            state.remove(members.pop(int(rng.integers(len(members)))))
        else:
            new = int(rng.choice([i for i in range(30) if i not in members]))
            members.append(new)
            state.add(new)
    assert state.merit == pytest.approx(_merit(sensitivity, members, criterion), rel=1e-5)
    before, gains = state.merit, state.gains()
    fresh = RankUpdates(sensitivity, criterion)
    fresh.rebuild(members)
    np.testing.assert_allclose(state.blocks, fresh.blocks, atol=1e-12)
    np.testing.assert_allclose(state.inverse, fresh.inverse, atol=1e-12)
    for new in set(range(30)) - set(members):
        fresh.rebuild([*members, new])
        if isinstance(criterion, DOptimal):
            assert 4 * (fresh.merit - before) == pytest.approx(gains[new])
        else:
            assert np.exp(-2 * before) - np.exp(-2 * fresh.merit) == pytest.approx(gains[new])
    fresh.rebuild(members)
    if isinstance(criterion, TraceOptimal):
        np.testing.assert_allclose(state.weighted_blocks, fresh.weighted_blocks, atol=1e-12)


def test_growing_keeps_its_digits_without_a_prior(rng):
    sensitivity = _sensitivity(rng, 60, 3, 12)
    criterion = TraceOptimal(np.eye(12), "A", uses_prior=False)
    found = greedy(sensitivity, 12, criterion)
    assert found.merit == pytest.approx(_merit(sensitivity, found.chosen, criterion), rel=1e-4)
    assert np.all(np.diff(found.history) > 0)


def test_greedy_sets_are_nested_and_exchange_never_loses_to_them(rng):
    sensitivity = _sensitivity(rng, 80, 3, 4, prior=1e-3)
    criterion = TraceOptimal(WEIGHT, "c")
    order = greedy(sensitivity, 12, criterion).chosen
    np.testing.assert_array_equal(greedy(sensitivity, 7, criterion).chosen, order[:7])
    assert exchange(sensitivity, 12, criterion).merit >= _merit(sensitivity, order, criterion) - 1e-12
    kept = exchange(sensitivity, 12, criterion, start=order, passes=0)
    np.testing.assert_array_equal(kept.chosen, order)


def test_columns_in_other_units_choose_the_same_d_optimal_set(rng):
    sensitivity = _sensitivity(rng, 60, 3, 6, prior=1e-3)
    mix = rng.normal(size=(6, 6)) @ np.diag(np.geomspace(1e-3, 1e3, 6))
    other = Sensitivity(sensitivity.jacobian @ mix, sensitivity.parameters, 1e-3 * mix.T @ mix)
    one, two = exchange(sensitivity, 8, DOptimal()), exchange(other, 8, DOptimal())
    assert set(one.chosen) == set(two.chosen)


def test_bad_input(rng):
    sensitivity = _sensitivity(rng, 6, 3, 10)
    with refused("E-DESIGN-017", "7", "6"):
        exchange(sensitivity, 7, DOptimal())
    with refused("E-DESIGN-019", "4"):
        exchange(sensitivity, 3, DOptimal())
    with refused("E-DESIGN-018", "exactly 4"):
        exchange(sensitivity, 4, SpectralCriterion("E"), start=[1, 2])
    with refused("E-DESIGN-018", "at most 4"):
        exchange(sensitivity, 4, DOptimal(), start=[1, 1])
    twins = np.repeat(sensitivity.jacobian[:, :, :5], 2, axis=2)
    with refused("E-DESIGN-016"):
        exchange(Sensitivity(twins, sensitivity.parameters, np.zeros((10, 10))), 4, DOptimal())
