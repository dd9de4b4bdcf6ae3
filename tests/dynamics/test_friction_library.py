"""Friction terms against their differential equation and closed forms, on the axis that really turns, in one go as in blocks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flexcal.data.recordings import Decimation
from flexcal.dynamics.friction import (
    FRICTION_TERMS,
    AsymmetricCoulomb,
    LoadCoulomb,
    Stribeck,
    SublinearViscous,
    WarmUp,
)
from flexcal.dynamics.friction.catalogue import LIBRARY, candidate_shapes
from flexcal.dynamics.friction.scale import ExcitationScale
from flexcal.dynamics.friction.terms import dahl
from flexcal.dynamics.inverse_model import CLASSIC, DriveTerm, Observation
from flexcal.dynamics.regression import blocks as rows
from flexcal.dynamics.signals import Motion, Window
from flexcal.model.robot import RobotModel, unit_of
from flexcal.model.torques import inertial_parameters, torque_regressor

SHAPE = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)


def term_columns(term: DriveTerm, model: RobotModel, motion: Motion) -> dict[tuple[str, int], np.ndarray]:
    return {(column.name, column.joint): column.values for column in term.columns(model, motion, {})}


def test_dahl_is_the_solution_of_its_differential_equation() -> None:
    """dz/dt = (ṡ - z |ṡ|)/δ over five seconds with reversals, integrated to 1e-10."""
    rates, sizes = np.array([1.0, 2.6, 5.7]), np.array([0.5, 0.3, 0.1])
    time = np.arange(0.0, 5.0, 1e-4)

    def position(t: np.ndarray) -> np.ndarray:
        return np.sum(sizes * np.sin(rates * np.asarray(t)[..., None]), axis=-1)

    def rate(t: float) -> float:
        return float(np.sum(sizes * rates * np.cos(rates * t)))

    expected = solve_ivp(
        lambda t, z: (rate(t) - z * abs(rate(t))) / 0.05,
        (0.0, 5.0),
        [0.0],
        t_eval=time,
        rtol=1e-10,
        atol=1e-12,
        max_step=1e-2,
    )
    found = dahl(position(time), 0.05, 0.0)
    assert np.sum(np.diff(np.sign(np.diff(position(time)))) != 0) > 4
    assert np.abs(found - expected.y[0]).max() < 1e-5


def test_dahl_stays_where_nothing_moves() -> None:
    assert np.array_equal(dahl(np.ones(5), 0.1, 0.4), np.full(5, 0.4))
    position = np.array([0.0, 0.1, 0.1, 0.1, 0.0])
    one = 1 - np.exp(-1.0)
    back = -1 + (one + 1) * np.exp(-1.0)
    np.testing.assert_allclose(dahl(position, 0.1, 0.0), [0.0, one, one, one, back], atol=1e-15)


@pytest.mark.parametrize(
    ("term", "key", "expected"),
    [
        (AsymmetricCoulomb(), "coulomb_asymmetry", lambda s, j: np.ones_like(s)),
        (SublinearViscous(), "sublinear_viscous", lambda s, j: np.sign(s) * np.abs(s) ** 0.5),
        (Stribeck(SHAPE), "stribeck", lambda s, j: np.sign(s) * np.exp(-(s**2) / SHAPE[j] ** 2)),
        (WarmUp(7.0), "warm_up", lambda s, j: s * np.exp(-np.arange(40) / 7.0)),
    ],
)
def test_the_shape_on_the_motor_that_turns(term, key, expected, tx40: RobotModel, motion: Motion) -> None:
    """The motor of joint 6 turns at the sum of the rates of joints 5 and 6, and both feel its friction; the others are their joints'."""
    found = term_columns(term, tx40, replace(motion, time=motion.time + 100.0))
    for j in range(5):
        np.testing.assert_allclose(
            found[(f"joint_{j + 1}.{key}", j)], expected(motion.dq[:, j], j), rtol=1e-12
        )
    both = expected(motion.dq[:, 4] + motion.dq[:, 5], 5)
    for joint in (4, 5):
        np.testing.assert_allclose(found[(f"joint_6.{key}", joint)], both, rtol=1e-12)
    assert len(found) == 7


def test_the_load_is_that_of_the_links(tx40: RobotModel, motion: Motion) -> None:
    """|what gravity and inertia of the links ask of the joint| times the direction of the motor."""
    inertials = inertial_parameters(tx40).ravel()
    found = term_columns(LoadCoulomb(inertials), tx40, motion)
    load = torque_regressor(tx40, motion.q, motion.dq, motion.ddq) @ inertials
    np.testing.assert_allclose(
        found[("joint_2.load_coulomb", 1)], np.abs(load[:, 1]) * np.sign(motion.dq[:, 1])
    )
    turned = np.sign(motion.dq[:, 4] + motion.dq[:, 5])
    np.testing.assert_allclose(found[("joint_6.load_coulomb", 4)], np.abs(load[:, 5]) * turned)


def library(model: RobotModel) -> tuple[DriveTerm, ...]:
    inertials = inertial_parameters(model).ravel()
    scale = ExcitationScale(np.ones(model.n), np.ones(model.n), 10.0, inertials)
    return (AsymmetricCoulomb(), *(candidate_shapes(name, scale)[-1].term for name in LIBRARY))


def test_every_term_has_a_column_for_every_joint_and_a_place_in_the_robot(tx40: RobotModel) -> None:
    """And names a unit of its own, but for the loads', which are numbers."""
    names = Observation(tx40, library(tx40)).names[60:]
    assert len(names) == 6 * len(FRICTION_TERMS[3:])
    assert {unit_of(name) == "1" for name in names if ".load_" not in name} == {False}
    changed = tx40.with_values({name: 0.5 for name in names})
    assert [changed.value(name) for name in names] == [0.5] * len(names)
    assert tx40.value(names[0]) == 0.0


def test_terms_that_remember_do_not_see_the_blocks(
    tx40: RobotModel, swing: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor where a window begins: the past counts, whether its rows are needed or not."""
    observation = Observation(tx40, (*CLASSIC, *library(tx40)))
    decimation = Decimation(4)

    def all_rows(window: Window) -> np.ndarray:
        parts = list(rows.regression_blocks(observation, swing, decimation, window))
        return np.hstack([np.vstack(part.reduced) for part in parts])

    monkeypatch.setattr(rows, "_BLOCK", 10**6)
    whole = all_rows(Window())
    monkeypatch.setattr(rows, "_BLOCK", 60)
    np.testing.assert_allclose(all_rows(Window()), whole, atol=1e-10)
    late = all_rows(Window(start=6.0))
    np.testing.assert_allclose(late, whole[:, -late.shape[1] :], atol=1e-10)
