"""Exciting trajectories as plans: round trip, their motion, what does not fit together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

from flexcal.data.experiments import labels
from flexcal.data.plans import (
    FourierPaths,
    MultisinePlan,
    SplinePaths,
    TrajectoryPlan,
    read_plan_of,
    write_plan,
)
from flexcal.files.formats import to_plain


def make_trajectory(**changes: Any) -> TrajectoryPlan:
    """Two trajectories of three joints with four harmonics."""
    rng = np.random.default_rng(3)
    values: dict[str, Any] = {
        "name": "small",
        "paths": FourierPaths(*(rng.normal(size=size) for size in ((2, 3), (2, 3, 4), (2, 3, 4)))),
        "payload": 0.0,
        "base_frequency_hz": 0.2,
        "periods": 3,
        "settle_periods": 1,
        "kp": np.array([3e3, 800.0, 60.0]),
        "kd": np.array([400.0, 20.0, 4.0]),
        "rate_hz": 4000.0,
        "torque": "held",
        "seed": 2**40,
    }
    return TrajectoryPlan(**(values | changes))


def test_round_trip(tmp_path: Path) -> None:
    plan = make_trajectory()
    write_plan(tmp_path / "plan.yaml", plan)
    again = read_plan_of(tmp_path / "plan.yaml", TrajectoryPlan)
    assert to_plain(again) == to_plain(plan)
    np.testing.assert_array_equal(again.paths.coefficients, plan.paths.coefficients)
    with refused("E-PLAN-022", "trajectory", "multisine"):
        read_plan_of(tmp_path / "plan.yaml", MultisinePlan)


def test_velocity_and_acceleration_are_derivatives() -> None:
    """Complex steps on a series written out independently of the plan."""
    plan = make_trajectory()
    sine, cosine = plan.paths.coefficients[1, 1:].T.reshape(3, 2, 4).swapaxes(0, 1)
    time = np.linspace(0.3, 4.1, 17)
    q, dq, ddq = plan.motion(1, time)
    k = 2 * np.pi * 0.2 * np.arange(1, 5)

    def velocity(t: np.ndarray) -> np.ndarray:
        angle = t[:, None, None] * k
        return np.sum(sine * np.sin(angle) + cosine * np.cos(angle), axis=2)

    np.testing.assert_allclose(dq, velocity(time), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ddq, velocity(time + 1e-20j).imag / 1e-20, rtol=1e-10, atol=1e-10)
    fine = np.linspace(time[0], time[1], 4001)
    moved = np.trapezoid(velocity(fine), fine, axis=0)
    np.testing.assert_allclose(q[1] - q[0], moved, atol=1e-6)


def test_motion_is_periodic_about_its_centre() -> None:
    plan = make_trajectory()
    time = np.arange(plan.samples_per_period) / plan.rate_hz
    now, later = plan.motion(0, time), plan.motion(0, time + 5.0)
    for one, other in zip(now, later, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    np.testing.assert_allclose(now[0].mean(axis=0), plan.paths.coefficients[0, 0], atol=1e-9)


def test_every_trajectory_has_a_label() -> None:
    names = [label.name for label in labels(make_trajectory())]
    assert names == [f"pose_1_realisation_{k}_experiment_1_plus" for k in (1, 2)]


@pytest.mark.parametrize(
    ("changes", "refusal"),
    [
        ({"kp": np.ones(2)}, ["E-PLAN-033", "kp", "2"]),
        ({"base_frequency_hz": 0.3}, ["E-PLAN-034"]),
        ({"settle_periods": 3}, ["E-PLAN-018"]),
        ({"payload": -1.0}, ["E-PLAN-019"]),
        ({"seed": -1}, ["E-PLAN-020", "-1"]),
    ],
)
def test_what_does_not_fit_is_said(changes: dict[str, Any], refusal: list[str]) -> None:
    with refused(*refusal):
        make_trajectory(**changes)


@pytest.mark.parametrize(
    ("paths", "refusal"),
    [
        (
            lambda: FourierPaths(np.zeros((2, 3)), np.zeros((2, 2, 4)), np.zeros((2, 3, 4))),
            ["E-PLAN-013", "sine"],
        ),
        (
            lambda: FourierPaths(np.zeros((2, 3)), np.zeros((2, 3, 4)), np.zeros((2, 3, 5))),
            ["E-PLAN-014"],
        ),
        (lambda: FourierPaths(np.zeros(3), np.zeros((1, 3, 4)), np.zeros((1, 3, 4))), ["E-PLAN-012"]),
        (lambda: SplinePaths(np.zeros((2, 3, 6))), ["E-PLAN-015", "7"]),
    ],
)
def test_paths_that_do_not_fit_are_said(paths: Callable[[], object], refusal: list[str]) -> None:
    with refused(*refusal):
        paths()


def test_splines_come_back_and_are_splines(tmp_path: Path) -> None:
    """Bit by bit through a file; between knots a polynomial of degree 5, and where all control points are one, at rest there."""
    control = np.random.default_rng(5).normal(size=(2, 3, 10))
    control[:, :, [0, 6, 7, 8, 9]] = control[:, :, 5:6]
    plan = make_trajectory(paths=SplinePaths(control))
    write_plan(tmp_path / "plan.yaml", plan)
    again = read_plan_of(tmp_path / "plan.yaml", TrajectoryPlan)
    assert isinstance(again.paths, SplinePaths)
    np.testing.assert_array_equal(again.paths.control, control)
    time = 5.0 * (2 + np.linspace(0, 1, 40)) / 10
    q, dq, ddq = plan.motion(0, time)
    fitted = np.polynomial.Polynomial.fit(time, q[:, 1], 5)
    np.testing.assert_allclose(fitted(time), q[:, 1], atol=1e-10)
    np.testing.assert_allclose(fitted.deriv()(time), dq[:, 1], atol=1e-8)
    np.testing.assert_allclose(fitted.deriv(2)(time), ddq[:, 1], atol=1e-7)
    rest = plan.motion(0, np.array([0.0, 5.0]))
    np.testing.assert_allclose(rest[0][0], control[0, :, 5], atol=1e-12)
    np.testing.assert_allclose(rest[1:], 0.0, atol=1e-9)


def test_of_a_misspelt_path_the_nearer_kind_is_named(tmp_path: Path) -> None:
    write_plan(tmp_path / "plan.yaml", make_trajectory())
    text = (tmp_path / "plan.yaml").read_text().replace("cosine:", "cosines:")
    (tmp_path / "plan.yaml").write_text(text)
    with refused("E-YAML-001", "cosine"):
        read_plan_of(tmp_path / "plan.yaml", TrajectoryPlan)
