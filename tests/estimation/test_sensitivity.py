import numpy as np
import pytest
from refusals import refused

from flexcal.estimation import Parameter, Parameters, Problem, Sensitivity, solve

PARAMETERS = Parameters(Parameter(name, "m", 0.0) for name in "abc")


def test_the_predicted_covariance_is_what_the_estimate_reports():
    jacobian = np.random.default_rng(0).standard_normal((10, 2, 3))
    parameters = PARAMETERS.replaced("a", prior_std=0.3)
    design = Sensitivity(jacobian, parameters, parameters.prior_information())
    chosen = [1, 4, 7]
    rows = jacobian[chosen].reshape(-1, 3)
    estimate = solve(Problem(parameters, lambda x: (np.ones(6) - rows @ x, -rows)))
    np.testing.assert_allclose(design.covariance(chosen), estimate.covariance, rtol=1e-9)
    np.testing.assert_allclose(design.subset(chosen).covariance(), estimate.covariance, rtol=1e-9)
    factor = design.factor(chosen)
    np.testing.assert_allclose(factor.T @ factor, rows.T @ rows + parameters.prior_information(), atol=1e-12)
    assert len(design) == 10


def test_what_stays_undetermined_is_named():
    design = Sensitivity(np.ones((4, 2, 3)) * [1.0, 1.0, 0.0], PARAMETERS, np.diag([0.0, 0.0, 1.0]))
    with refused("E-FIT-025", "2", "3"):
        design.covariance()


@pytest.mark.parametrize(
    ("jacobian", "prior", "code"),
    [
        (np.ones((4, 2, 2)), np.eye(3), "E-FIT-022"),
        (np.ones((4, 2, 3)), np.eye(2), "E-FIT-023"),
        (np.ones((4, 2, 3)), -np.eye(3), "E-FIT-024"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(jacobian, prior, code: str):
    with refused(code):
        Sensitivity(jacobian, PARAMETERS, prior)
