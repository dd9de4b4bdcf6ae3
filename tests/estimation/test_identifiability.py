import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from flexcal.estimation import analyse, name_direction

NAMES = ("a", "b", "c", "d", "e")


def tied(seed=0):
    """c = 2 a - 5e-4 b and e = 3 d, in very different units."""
    jacobian = np.random.default_rng(seed).standard_normal((40, 5)) * [1.0, 1e4, 1.0, 1e-5, 1.0]
    jacobian[:, 2] = 2.0 * jacobian[:, 0] - 5e-4 * jacobian[:, 1]
    jacobian[:, 4] = 3e5 * jacobian[:, 3]
    return jacobian


def test_gap_is_that_of_the_last_kept_and_the_first_dropped():
    """Columns of equal length, of which the third is nearly the first: 3e-13 of its length are its own."""
    jacobian = np.eye(4)[:, :3]
    jacobian[:, 2] = jacobian[:, 0] + 3e-13 * np.eye(4)[2]
    found = analyse(jacobian, NAMES[:3], prefer=NAMES[:2])
    assert found.rank == 2
    assert found.gap == pytest.approx(-np.log10(3e-13), rel=1e-3)


def test_rank_gap_and_regrouping():
    found = analyse(tied(), NAMES, prefer=("a", "b", "d"))
    assert found.rank == 3
    assert found.kept_names == ("a", "b", "d")
    assert found.gap > 9
    assert np.all(found.singular_values[3:] < 1e-12) and found.singular_values[2] > 1e-3
    assert [d.name for d in found.dropped] == ["c", "e"]
    assert dict(found.dropped[0].absorbed_by) == pytest.approx({"a": 2.0, "b": -5e-4})
    assert dict(found.dropped[1].absorbed_by) == pytest.approx({"d": 3e5})
    expected = [[1, 0, 2, 0, 0], [0, 1, -5e-4, 0, 0], [0, 0, 0, 1, 3e5]]
    np.testing.assert_allclose(found.regrouping, expected, atol=1e-10)


def test_preference_decides_what_is_kept():
    assert analyse(tied(), NAMES, prefer=("c", "e", "b")).kept_names == ("b", "c", "e")
    assert analyse(tied(), NAMES, prefer=("e", "d")).kept_names[-1] == "e"


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 8), st.integers(0, 6), st.integers(0, 2**32 - 1))
def test_regrouping_reproduces_every_jacobian(rank, extra, seed):
    rng = np.random.default_rng(seed)
    jacobian = rng.standard_normal((30, rank)) @ rng.standard_normal((rank, rank + extra))
    jacobian *= 10.0 ** rng.uniform(-5, 5, rank + extra)
    names = [f"p{i}" for i in range(rank + extra)]
    found = analyse(jacobian, names, prefer=list(rng.permutation(names)[:2]))
    assert found.rank == rank
    rebuilt = jacobian[:, found.kept] @ found.regrouping
    scale = np.linalg.norm(jacobian, axis=0)
    np.testing.assert_allclose(rebuilt / scale, jacobian / scale, atol=1e-6)


def test_fewer_rows_than_parameters():
    found = analyse(np.random.default_rng(1).standard_normal((3, 5)), NAMES)
    assert found.rank == 3 and len(found.dropped) == 2 and found.diagonal.shape == (5,)


def test_full_rank_and_no_information():
    full = analyse(np.eye(5), NAMES)
    assert full.rank == 5 and full.dropped == () and full.gap == math.inf
    nothing = analyse(np.zeros((4, 5)), NAMES)
    assert nothing.rank == 0 and all(d.absorbed_by == () for d in nothing.dropped)


def test_the_scale_says_what_is_small():
    jacobian = np.diag([1.0, 1e-12, 1, 1, 1])
    assert analyse(jacobian, NAMES).rank == 5
    assert analyse(jacobian, NAMES, scale=np.ones(5)).rank == 4


def test_weak_directions_are_named():
    jacobian = np.random.default_rng(2).standard_normal((40, 5))
    jacobian[:, 1] = jacobian[:, 0] + 1e-4 * jacobian[:, 1]
    ((value, name),) = analyse(jacobian, NAMES).weak_directions(1)
    assert value < 1e-3
    assert name in ("0.71 a - 0.71 b", "0.71 b - 0.71 a")


def test_a_direction_reads_well():
    names = ("joint_2.offset", "joint_3.offset", "tool.offset")
    assert name_direction(np.array([-0.71, 0.7, 0.001]), names) == "0.71 joint_2.offset - 0.70 joint_3.offset"
    assert name_direction(np.array([0.0, 0.0, 5.0]), names) == "1.00 tool.offset"
    assert name_direction(np.zeros(3), names) == "0"


@pytest.mark.parametrize(
    ("jacobian", "options", "refusal"),
    [
        (np.eye(4), {}, ["E-FIT-003", "5"]),
        (np.full((5, 5), np.nan), {}, ["E-FIT-004", "a"]),
        (np.eye(5), {"prefer": ("x",)}, ["E-FIT-002", "x"]),
        (np.eye(5), {"scale": np.zeros(5)}, ["E-FIT-005"]),
    ],
)
def test_bad_input_is_refused_in_a_sentence(jacobian, options, refusal: list[str]):
    with refused(*refusal):
        analyse(jacobian, NAMES, **options)
