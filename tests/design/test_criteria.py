import numpy as np
import pytest
from refusals import refused

from flexcal.design.optimality import DOptimal, SpectralCriterion, TraceOptimal, observability
from flexcal.estimation import Parameter, Parameters, Sensitivity

ALL = [
    DOptimal(),
    TraceOptimal(np.diag([1.0, 2, 3, 4]) + 0.5, "c"),
    *map(SpectralCriterion, ("E", "O1", "O2", "O3", "O4", "O5")),
]


def _sensitivity(jacobian):
    size = jacobian.shape[2]
    return Sensitivity(
        jacobian, Parameters(Parameter(f"p{i}", "1", 0.0) for i in range(size)), np.zeros((size, size))
    )


@pytest.mark.parametrize("criterion", ALL, ids=lambda c: c.name)
def test_gradient_against_differences(criterion, rng):
    rows = rng.normal(size=(9, 4))
    information = rows.T @ rows
    gradient = criterion.gradient(information)
    np.testing.assert_allclose(gradient, gradient.T)
    for _ in range(5):
        step = rng.normal(size=(4, 4))
        step = step + step.T
        slope = (
            criterion.merit(information + 1e-6 * step) - criterion.merit(information - 1e-6 * step)
        ) / 2e-6
        assert np.sum(gradient * step) == pytest.approx(slope, rel=1e-5, abs=1e-8)


def test_closed_forms_on_a_diagonal():
    information = np.diag([1.0, 4.0, 16.0])
    assert DOptimal().merit(information) == pytest.approx(np.log(64) / 3)
    assert TraceOptimal(np.eye(3), "A").trace(information) == pytest.approx(1 + 1 / 4 + 1 / 16)
    assert TraceOptimal(np.diag([0, 8.0, 0]), "c").trace(information) == pytest.approx(2.0)
    expected = {"E": 1.0, "O1": 2.0, "O2": 0.25, "O3": 1.0, "O4": 0.25, "O5": 1 / (1 + 0.5 + 0.25)}
    for name, value in expected.items():
        assert SpectralCriterion(name).merit(information) == pytest.approx(value)


def test_observability_of_a_set(rng):
    jacobian = np.zeros((4, 3, 3))
    jacobian[0] = np.diag([3.0, 0, 0])
    jacobian[1] = np.diag([0, 6.0, 0])
    jacobian[3] = np.diag([0, 0, 12.0])
    found = observability(_sensitivity(jacobian), [0, 1, 3])
    assert found.o1 == pytest.approx(6 / np.sqrt(3))
    assert (found.o2, found.o3, found.o4) == pytest.approx((0.25, 3.0, 0.75))
    assert found.o5 == pytest.approx(1 / (1 / 3 + 1 / 6 + 1 / 12))
    assert found.sigma_min == pytest.approx(9.0)


def test_too_few_poses_and_singular_sets(rng):
    with refused("E-DESIGN-013", "4"):
        observability(_sensitivity(rng.normal(size=(5, 3, 4))), [2])
    singular = np.diag([1.0, 0.0])
    assert DOptimal().merit(singular) == -np.inf
    assert TraceOptimal(np.eye(2), "A").merit(singular) == -np.inf
    with refused("E-DESIGN-014"):
        DOptimal().gradient(singular)
    with refused("E-DESIGN-012"):
        SpectralCriterion("O6")
