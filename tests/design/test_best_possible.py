from itertools import combinations

import numpy as np

from flexcal.design.optimality import TraceOptimal, exchange, trace_lower_bound
from flexcal.estimation import Parameter, Parameters, Sensitivity

WEIGHT = np.diag([1.0, 5.0, 0.2]) + 0.1


def _sensitivity(rng, candidates, prior):
    jacobian = rng.normal(size=(candidates, 2, 3)) * [1, 3, 10]
    return Sensitivity(jacobian, Parameters(Parameter(n, "1", 0.0) for n in "abc"), prior * np.eye(3))


def test_no_set_is_below_it(rng):
    criterion = TraceOptimal(WEIGHT, "c")
    for prior in (1e-6, 0.1, 5.0):
        for _ in range(5):
            sensitivity = _sensitivity(rng, 9, prior)
            counts = np.array([2, 3, 4, 6])
            least = trace_lower_bound(sensitivity, criterion, counts)
            for count, bound in zip(counts, least, strict=True):
                sets = (
                    sensitivity.jacobian[list(c)].reshape(-1, 3) for c in combinations(range(9), int(count))
                )
                best = min(criterion.trace(rows.T @ rows + sensitivity.prior_information) for rows in sets)
                assert bound <= best * (1 + 1e-9)


def test_it_is_nearly_reached_by_many_of_many(rng):
    criterion = TraceOptimal(WEIGHT, "c")
    sensitivity = _sensitivity(rng, 3000, 0.1)
    like = sensitivity.jacobian / np.linalg.norm(sensitivity.jacobian / [1, 3, 10], axis=2, keepdims=True)
    sensitivity = Sensitivity(like, sensitivity.parameters, sensitivity.prior_information)
    reached = np.exp(-2 * exchange(sensitivity, 60, criterion).merit)
    (least,) = trace_lower_bound(sensitivity, criterion, np.array([60]))
    assert 0.85 * reached < least <= reached
