"""Least squares within cones, against closed forms for cones of one number."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flexcal.estimation.conic_constraint import Cone
from flexcal.estimation.conic_least_squares import ConicFit


def half_line(index: int, reference: float, std: float) -> Cone:
    return Cone(np.array([index]), np.ones((1, 1, 1)), np.full((1, 1), reference), 0.0, std)


def test_all_priors_decide_what_the_data_do_not_see() -> None:
    """The most probable number of two priors, relative to their references; a cone without a prior, before and after, adds nothing."""
    cones = [
        half_line(0, 1.0, math.inf),
        half_line(1, 2.0, 0.3),
        half_line(1, 3.0, 0.2),
        half_line(0, 9.0, math.inf),
    ]
    fit = ConicFit(np.array([5.0, 0.1]), np.array([[0.5], [0.0]]), np.array([[0.0], [1.0]]), cones, 1.0)
    parameters, risen = fit.solve()
    weight, reference = np.array([1 / (2.0 * 0.3) ** 2, 1 / (3.0 * 0.2) ** 2]), np.array([2.0, 3.0])
    assert parameters[1] == pytest.approx(weight @ reference / weight.sum(), rel=1e-5)
    assert parameters[0] == pytest.approx(5.0, abs=0.05 * 0.5)
    assert risen < 0.05**2 * 1.01


def test_a_cone_that_the_data_leave_moves_them_to_its_edge() -> None:
    fit = ConicFit(
        np.array([-1.0, 1.0]),
        np.array([[0.5], [0.0]]),
        np.array([[0.0], [1.0]]),
        [half_line(0, 1.0, math.inf), half_line(1, 4.0, 0.1)],
        1.0,
    )
    parameters, risen = fit.solve()
    assert -1e-5 <= parameters[0] < 0.05
    assert risen == pytest.approx((1.0 / 0.5) ** 2, rel=0.06)
    assert parameters[1] == pytest.approx(4.0, rel=1e-5)
