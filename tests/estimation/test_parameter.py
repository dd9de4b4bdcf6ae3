import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from flexcal.estimation import Parameter, Parameters

STIFFNESS = Parameter("joint_1.drive.stiffness", "N m/rad", 1.4e5, lower=1e3, prior_std=0.3, scale="log")
OFFSET = Parameter("joint_1.offset", "rad", 0.01, lower=-0.1, upper=0.1)
BOTH = Parameters([STIFFNESS, OFFSET])


@given(st.floats(1e-6, 1e9), st.floats(-1e3, 1e3))
def test_coordinates_and_natural_values_are_inverse(positive, any_value):
    parameters = Parameters(
        [Parameter("k", "N m/rad", positive, scale="log"), Parameter("o", "rad", any_value)]
    )
    np.testing.assert_allclose(
        parameters.natural(parameters.coordinates()), [positive, any_value], rtol=1e-13
    )
    x = parameters.coordinates()
    assert parameters.with_coordinates(x)["o"].value == any_value


def test_slope_is_the_derivative_of_the_natural_value():
    x, step = BOTH.coordinates(), 1e-6
    finite = (BOTH.natural(x + step) - BOTH.natural(x - step)) / (2 * step)
    np.testing.assert_allclose(BOTH.natural_slope(x), finite, rtol=1e-8)


def test_bounds_prior_and_values_by_name():
    lower, upper = BOTH.bounds()
    np.testing.assert_allclose(lower, [math.log(1e3), -0.1])
    np.testing.assert_allclose(upper, [math.inf, 0.1])
    np.testing.assert_allclose(BOTH.prior_information(), np.diag([1 / 0.09, 0.0]))
    np.testing.assert_allclose(BOTH.coordinates({"joint_1.offset": 0.02}), [math.log(1.4e5), 0.02])


def test_moving_the_value_leaves_the_prior_where_it_was():
    moved = BOTH.with_coordinates([math.log(2e5), 0.0])
    assert moved["joint_1.drive.stiffness"].value == pytest.approx(2e5)
    np.testing.assert_allclose(moved.prior_mean(), BOTH.prior_mean())


def test_collection():
    assert BOTH.names == ("joint_1.drive.stiffness", "joint_1.offset")
    assert BOTH.units == ("N m/rad", "rad")
    assert BOTH.subset(["joint_1.offset"]).items == (OFFSET,)
    assert BOTH.replaced("joint_1.offset", value=0.05)["joint_1.offset"].value == 0.05
    assert (BOTH + Parameters([Parameter("x", "m", 0.0)])).names[-1] == "x"
    assert "joint_1.offset" in BOTH and "x" not in BOTH
    assert [item.name for item in BOTH] == list(BOTH.names)


def test_an_unknown_name_lists_close_ones():
    with refused("E-FIT-018", "joint_1.offset"):
        BOTH.index("joint_1.ofset")


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"value": math.nan}, "E-FIT-012"),
        ({"value": 2.0, "upper": 1.0}, "E-FIT-013"),
        ({"value": -1.0, "scale": "log"}, "E-FIT-016"),
        ({"value": 1.0, "prior_mean": 0.0, "scale": "log"}, "E-FIT-016"),
        ({"value": 1.0, "prior_std": 0.0}, "E-FIT-014"),
        ({"value": 1.0, "scale": "cubic"}, "E-FIT-011"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(fields, code):
    with refused(code, "x"):
        Parameter("x", "m", **fields)


def test_names_are_unique():
    with refused("E-FIT-017", "joint_1.offset"):
        Parameters([OFFSET, OFFSET])
