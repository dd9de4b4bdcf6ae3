import numpy as np
import pytest
from refusals import refused

from flexcal.design.optimality import (
    DOptimal,
    SpectralCriterion,
    TraceOptimal,
    exchange,
    exchange_on_shortlist,
    shortlist,
)
from flexcal.design.optimality.shortlist import predicted_gains
from flexcal.estimation import Parameter, Parameters, Sensitivity

WEIGHT = np.diag([1.0, 5.0, 0.2, 2.0, 1.0, 3.0]) + 0.1


@pytest.fixture(scope="module")
def many():
    rng = np.random.default_rng(9)
    jacobian = rng.normal(size=(1500, 3, 6)) * np.geomspace(1, 10, 6)
    names = Parameters(Parameter(f"p{i}", "1", 0.0) for i in range(6))
    return Sensitivity(jacobian, names, 0.1 * np.eye(6))


@pytest.mark.parametrize("criterion", [DOptimal(), TraceOptimal(WEIGHT, "c")], ids=lambda c: c.name)
def test_a_promise_is_the_growth_of_the_merit_per_weight(many, criterion):
    few = many.subset(np.arange(40))
    chosen = np.arange(8)
    rows = few.jacobian[chosen].reshape(-1, 6)
    information = rows.T @ rows + few.prior_information
    step = 1e-6
    growth = [
        (criterion.merit(information + step * block.T @ block) - criterion.merit(information - step * block.T @ block))
        / (2 * step)
        for block in few.jacobian
    ]  # fmt: skip
    np.testing.assert_allclose(predicted_gains(few, chosen, criterion), growth, rtol=1e-4)


def test_the_promise_for_sigma_min_is_that_of_a_power_mean_of_the_eigenvalues(many):
    few, chosen = many.subset(np.arange(30)), np.arange(10)
    rows = few.jacobian[chosen].reshape(-1, 6)
    information = rows.T @ rows

    def mean(matrix):
        return np.sum(np.linalg.eigvalsh(matrix) ** -8.0) ** (-1 / 8)

    step = 1e-6
    growth = np.array(
        [mean(information + step * b.T @ b) - mean(information - step * b.T @ b) for b in few.jacobian]
    )
    found = predicted_gains(few, chosen, SpectralCriterion("E"))
    np.testing.assert_allclose(found / found.max(), growth / growth.max(), atol=5e-3)


@pytest.mark.parametrize(
    "criterion", [DOptimal(), TraceOptimal(WEIGHT, "c"), SpectralCriterion("E")], ids=lambda c: c.name
)
def test_nothing_is_lost_against_the_exchange_over_all(many, criterion, monkeypatch):
    monkeypatch.setattr(shortlist, "MANY", 500)
    monkeypatch.setattr(shortlist, "SHORT", 150)
    found, full = exchange_on_shortlist(many, 12, criterion), exchange(many, 12, criterion)
    assert len(set(found.chosen)) == 12
    rows = many.jacobian[found.chosen].reshape(-1, 6)
    prior = many.prior_information if criterion.uses_prior else 0.0
    assert found.merit == pytest.approx(criterion.merit(rows.T @ rows + prior))
    if criterion.name == "E":
        assert found.merit > 0.95 * full.merit
    else:
        assert np.exp(found.merit - full.merit) > 0.99
    assert np.all(np.diff(found.history) >= -1e-9)


def test_few_candidates_are_exchanged_all_at_once(many):
    few = many.subset(np.arange(300))
    np.testing.assert_array_equal(
        exchange_on_shortlist(few, 9, DOptimal()).chosen, exchange(few, 9, DOptimal()).chosen
    )


def test_bad_input(many, monkeypatch):
    monkeypatch.setattr(shortlist, "MANY", 500)
    with refused("E-DESIGN-017", "1501", "1500"):
        exchange_on_shortlist(many, 1501, DOptimal())
