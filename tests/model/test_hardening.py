"""Drives that harden: rest positions, tangent stiffness and derivatives against the torque of Pinocchio and finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium, tangent_ratio, twist_by_hardening, twist_from_torque
from flexcal.model.vibration import linearise

POSE = np.array([0.4, 1.0, -0.3, 0.7, -0.5, 0.2])


@pytest.fixture
def hard(tx90l: RobotModel) -> RobotModel:
    """The TX90L whose drives are 20 %, 15 % and 30 % over their linear torque at 1 mrad."""
    return replace(tx90l, springs=replace(tx90l.springs, hardening=np.array([0.2, 0.15, 0.3, 0, 0, 0])))


@pytest.mark.parametrize("hardening", [0.0, 0.01, 0.3, 10.0])
@pytest.mark.parametrize("torque", [-400.0, -3.0, 0.0, 250.0])
def test_a_twist_carries_its_torque(torque: float, hardening: float) -> None:
    stiffness = 2e5
    found = float(twist_from_torque(np.array([torque]), np.array([stiffness]), np.array([hardening]))[0])
    expected = brentq(lambda x: stiffness * (x + hardening * 1e6 * x**3) - torque, -0.01, 0.01, xtol=1e-16)
    assert found == pytest.approx(expected, abs=1e-14)


def test_the_twist_falls_with_the_hardening() -> None:
    at = [twist_from_torque(np.array([250.0]), np.array([2e5]), np.array([a])) for a in (0.299, 0.301)]
    middle = twist_from_torque(np.array([250.0]), np.array([2e5]), np.array([0.3]))
    assert (at[1] - at[0]) / 2e-3 == pytest.approx(twist_by_hardening(middle, np.array([0.3])), rel=1e-4)


def test_hardening_drives_carry_the_arm(hard: RobotModel) -> None:
    """What the springs hold at the twist of the arm is the torque at rest."""
    rest = static_equilibrium(hard, POSE)
    twist = rest.deflection[0, :3, 2]
    held = hard.springs.stiffness[:3, 2] * (twist + 1e6 * hard.springs.hardening[:3] * twist**3)
    assert np.abs(twist).max() > 5e-4
    assert -held == pytest.approx(
        rest.torque[0, :3], rel=5e-3
    )  # it hardens by the load of the undeflected arm
    soft = static_equilibrium(
        replace(hard, springs=replace(hard.springs, hardening=np.zeros(6))), POSE
    ).deflection[0, 1, 2]
    assert abs(twist[1]) < 0.97 * abs(soft)


def test_small_motion_meets_the_tangent_stiffness(hard: RobotModel, tx90l: RobotModel) -> None:
    rest = static_equilibrium(hard, POSE)
    twist = rest.deflection[0, :, 2]
    steeper = tangent_ratio(twist, hard.springs.hardening)
    rotors = slice(0, 3)
    stiffness = np.diag(linearise(hard, POSE).stiffness[rotors, rotors])
    assert steeper.max() > 1.1
    assert stiffness == pytest.approx(steeper[:3] * tx90l.springs.stiffness[:3, 2], rel=2e-3)


def test_the_compliance_is_that_of_small_motion(hard: RobotModel) -> None:
    """A kilogram more at the flange twists drive 2 by its torque over the tangent stiffness."""
    rest = static_equilibrium(hard, POSE, sensitivities=True)
    column = rest.axes.tolist().index([1, 2])
    steeper = tangent_ratio(rest.deflection[0, 1, 2], hard.springs.hardening[1])
    linear = static_equilibrium(
        replace(hard, springs=replace(hard.springs, hardening=np.zeros(6))), POSE, sensitivities=True
    )
    ratio = rest.compliance[0, column, column] / linear.compliance[0, column, column]
    assert ratio == pytest.approx(1 / steeper, rel=3e-3)
