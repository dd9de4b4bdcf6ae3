"""Whether points can be this robot's, and what would make them: joints counted the other way, from another zero, in another order."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.importing.columns import ColumnAssignment, check_nominal
from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import rpy_rotation

PLACED = ColumnAssignment.plain("q", tuple(f"J{i}" for i in range(1, 7)), ("deg",) * 6, "")


@pytest.fixture(scope="module")
def measured(tx90l):
    """Joint positions (N, 6) and points (N, 3) of a TX90L before a tracker; half a millimetre of noise stands for its errors."""
    rng = np.random.default_rng(8)
    lower, upper = (np.array([getattr(joint, side) for joint in tx90l.joints]) for side in ("lower", "upper"))
    q = rng.uniform(0.8 * lower, 0.8 * upper, (25, 6))
    points = point_kinematics(tx90l, q, jacobians=False).position @ rpy_rotation(np.array([0.1, 0.2, 1.0])).T
    return q, points + np.array([2.0, -1.0, 0.5]) + rng.normal(0, 5e-4, points.shape)


def test_a_robot_that_fits(tx90l, measured) -> None:
    found = check_nominal(tx90l, *measured, PLACED)
    assert found is not None and not found.doubtful and found.rms < 2e-3
    assert check_nominal(tx90l, measured[0][:5], measured[1][:5], PLACED) is None


@pytest.mark.parametrize(
    ("signs", "zeros", "options"),
    [
        ((1, 1, -1, 1, 1, 1), (0, 0, 0, 0, 0, 0), ("q3=-J3[deg]",)),
        ((1, -1, 1, 1, -1, 1), (0, 0, 0, 0, 0, 0), ("q2=-J2[deg]", "q5=-J5[deg]")),
        ((1, 1, 1, 1, 1, 1), (0, 90, 0, 0, 0, 0), ("q2=J2[deg]+90",)),
        ((1, 1, -1, 1, 1, 1), (0, -90, 0, 0, 0, 0), ("q2=J2[deg]-90", "q3=-J3[deg]")),
    ],
)
def test_signs_and_zeros(tx90l, measured, signs, zeros, options) -> None:
    q, points = measured
    shown = (q - np.deg2rad(zeros)) * signs
    found = check_nominal(tx90l, shown, points, PLACED)
    assert found is not None and found.doubtful and found.options == options


def test_another_order_and_a_left_handed_frame(tx90l, measured) -> None:
    q, points = measured
    turned = check_nominal(tx90l, q[:, ::-1], points, PLACED)
    assert turned is not None and turned.options[0] == "q1=J6[deg]" and len(turned.options) == 6
    mirrored = check_nominal(tx90l, q, points[:, [1, 0, 2]], PLACED)
    assert mirrored is not None and "left-handed" in mirrored.proposal and mirrored.options == ()


def test_another_unit(tx90l, measured) -> None:
    """Inches that were read as millimetres, and centimetres that were read as metres."""
    q, points = measured
    read = ColumnAssignment.plain("xyz", ("X", "Y", "Z"), ("mm",) * 3, "")
    found = check_nominal(tx90l, q, points / 25.4, PLACED, points=read)
    assert found is not None and found.doubtful and "in inches, but were read in mm" in found.proposal
    assert found.options == ("x=25.4*X[mm]", "y=25.4*Y[mm]", "z=25.4*Z[mm]")
    read = ColumnAssignment.plain("xyz", ("X", "Y", "Z"), ("m",) * 3, "")
    found = check_nominal(tx90l, q, 100 * points, PLACED, points=read)
    assert found is not None and found.options[0] == "x=0.01*X[m]"
    fits = check_nominal(tx90l, *measured, PLACED, points=read)
    assert fits is not None and not fits.proposal


def test_rows_that_do_not_belong_together_have_no_explanation(tx90l, measured) -> None:
    q, points = measured
    found = check_nominal(tx90l, q[::-1], points, PLACED)
    assert found is not None and found.doubtful and found.proposal == "" and found.options == ()


def test_a_point_that_sits_elsewhere_is_no_fault(tx90l, measured) -> None:
    q, _ = measured
    at = point_kinematics(tx90l, q, jacobians=False)
    shift = np.array([0.03, -0.07, 0.05])
    found = check_nominal(tx90l, q, at.position + at.orientation @ shift, PLACED)
    assert found is not None and not found.doubtful and found.rms > 0.02
    np.testing.assert_allclose(found.moved, tx90l.point().xyz + shift, atol=2e-3)


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_a_camera_on_the_hand_is_said_to_be_unsupported(tx90l, measured, noise) -> None:
    q, _ = measured
    at = point_kinematics(tx90l, q, jacobians=False)
    camera, place = rpy_rotation(np.array([0.3, -0.4, 2.0])), np.array([1.2, 0.3, 0.1])
    seen = np.einsum("nji,nj->ni", at.orientation, place - at.position) @ camera + np.array([0.05, 0.0, 0.1])
    seen += np.random.default_rng(2).normal(0, noise, seen.shape)
    found = check_nominal(tx90l, q, seen, PLACED)
    assert found is not None and found.doubtful and not found.supported and "eye-in-hand" in found.proposal


def test_points_at_random_are_not_said_to_be_seen_from_the_hand(tx90l, measured) -> None:
    q, points = measured
    for seed in range(5):
        shuffled = np.random.default_rng(seed).permutation(points[:12])
        found = check_nominal(tx90l, q[:12], shuffled, PLACED)
        assert found is not None and found.doubtful and found.supported
