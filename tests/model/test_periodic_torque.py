"""Torques of a moving elastic arm against the rigid regressor and the static equilibrium."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque, static_equilibrium
from flexcal.model.torques import inertial_parameters, torque_regressor
from flexcal.model.vibration import periodic_torque

PERIOD = 5.0


def swing(joints: int, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two harmonics in every joint."""
    rng = np.random.default_rng(1)
    omega = 2 * np.pi / PERIOD * np.array([1, 2])[:, None]
    angle = np.arange(samples)[:, None, None] * PERIOD / samples * omega + rng.uniform(0, 6, (2, joints))
    size = rng.uniform(0.2, 0.6, (2, joints))
    q = np.sum(size * np.sin(angle), axis=1)
    dq = np.sum(size * omega * np.cos(angle), axis=1)
    return q, dq, -np.sum(size * omega**2 * np.sin(angle), axis=1)


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


def test_stiff_springs_make_the_rigid_robot(tx90l: RobotModel) -> None:
    states = swing(6, 40)
    stiff = replace(tx90l, springs=replace(tx90l.springs, stiffness=1e6 * tx90l.springs.stiffness))
    rigid = torque_regressor(tx90l, *states) @ inertial_parameters(tx90l)
    np.testing.assert_allclose(periodic_torque(stiff, *states, PERIOD, 0.0), rigid, atol=2e-4)
    soft = periodic_torque(tx90l, *states, PERIOD, 0.0)
    assert np.abs(soft - rigid).max() > 0.5


def test_at_rest_it_holds_the_sagging_arm(tx90l: RobotModel, rng: np.random.Generator) -> None:
    """The torque of the sprung motors at rest with the payload; a rigid arm would need another."""
    for q in rng.uniform(-1.2, 1.2, (5, 6)):
        still = np.zeros((4, 6))
        torque = periodic_torque(tx90l, still + q, still, still, PERIOD)
        rest = static_equilibrium(tx90l, q[None])
        np.testing.assert_allclose(torque[:, :3], np.broadcast_to(rest.torque[:, :3], (4, 3)), atol=2e-3)
        assert np.abs(gravity_torque(tx90l, q[None]) - rest.torque)[0, :3].max() > 0.01


def test_a_heavy_arm_on_soft_springs_lags(tx90l: RobotModel) -> None:
    """One axis against its own equation of motion, I (q̈ + δ̈) = τ and δ = -τ/c: I q̈/(1 - (ω/ω₀)²) to first order in (ω/ω₀)²."""
    stiffness = 1e6 * tx90l.springs.stiffness
    stiffness[0, 2] = tx90l.springs.stiffness[0, 2]
    light = replace(
        tx90l,
        links=replace(
            tx90l.links,
            mass=np.array([1e-9] * 5 + [5.0]),
            com=np.zeros((6, 3)),
            inertia=np.array([np.zeros((3, 3))] * 5 + [20.0 * np.eye(3)]),
        ),
        springs=replace(tx90l.springs, stiffness=stiffness),
    )
    omega = 2 * np.pi / PERIOD
    time = np.arange(16) * PERIOD / 16
    unit = np.eye(6)[0]
    q, dq, ddq = (
        np.outer(f, unit)
        for f in (np.sin(omega * time), omega * np.cos(omega * time), -(omega**2) * np.sin(omega * time))
    )
    bend = np.deg2rad([0, 0, 90, 0, 0, 0])
    rigid = torque_regressor(light, q + bend, dq, ddq) @ inertial_parameters(light)
    inertia = float(rigid[4, 0] / ddq[4, 0])
    torque = periodic_torque(light, q + bend, dq, ddq, PERIOD, 0.0)
    softened = (omega**2) * inertia / light.springs.stiffness[0, 2]
    np.testing.assert_allclose(torque[:, 0], rigid[:, 0] * (1 + softened), rtol=1e-6, atol=1e-6)
