"""Flexible drives with coarse encoders: what the rounding does to stiffness and inertias is removed, on an arm of the test's own."""

from __future__ import annotations

import numpy as np
import pytest
from over_seeds import over_seeds

from flexcal import Recording, RobotModel, identify_dynamics
from flexcal.jobs.dynamics.result import DynamicsIdentification

URDF = """<robot name="one"><link name="base"/><link name="link"><inertial><mass value="3"/><origin xyz="0.2 0 0"/>
<inertia ixx="0.1" iyy="0.1" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="20" effort="500"/></joint></robot>"""
INERTIA, ARM_VISCOUS = 0.42, 0.3
TRUE = {
    "hinge.drive.stiffness": 2e4,
    "hinge.rotor_inertia": 0.6,
    "hinge.viscous": 3.0,
    "hinge.coulomb": 1.1,
}


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    folder = tmp_path_factory.mktemp("one")
    (folder / "one.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text(
        "robot: one.urdf\nelastic: [{joint: hinge, drive: {stiffness: 15000}}]\n"
    )
    return RobotModel.from_yaml(folder / "robot.yaml")


def recorded(seed: int, step: float) -> Recording:
    """Twenty seconds at 1 kHz, of positions rounded to `step` (rad) and a torque with noise of 0.05 N m."""
    rng = np.random.default_rng([46, seed])
    time = np.arange(20_000) / 1000
    rate = 2 * np.pi * np.array([0.35, 0.7, 1.15, 1.9, 2.7])
    sizes = np.array([0.5, 0.3, 0.15, 0.06, 0.03]) * rng.uniform(0.7, 1.3, 5)
    angle = rate * time[:, None] + rng.uniform(0, 2 * np.pi, 5)
    q, dq, ddq, third, fourth = (
        (sizes * rate**order * np.sin(angle + order * np.pi / 2)).sum(axis=1) for order in range(5)
    )
    stiffness, rotor, viscous, coulomb = TRUE.values()
    twist, twist_rate, twist_push = (
        (INERTIA * push + ARM_VISCOUS * speed) / stiffness
        for push, speed in ((ddq, dq), (third, ddq), (fourth, third))
    )
    speed = dq + twist_rate
    torque = rotor * (ddq + twist_push) + viscous * speed + coulomb * np.sign(speed) + stiffness * twist
    torque += 0.05 * rng.standard_normal(len(time))
    motor, arm = q + twist, q
    if step:
        motor, arm = step * np.rint(motor / step), step * np.rint(arm / step)
    return Recording(time_step=1e-3, q=motor[:, None], torque=torque[:, None], arm=arm[:, None])


def of_one_recording(seed: int, model: RobotModel, step: float) -> np.ndarray:
    """Errors over their standard deviations."""
    return errors(identify_dynamics(model, [recorded(seed, step)], flexible=True, friction="classic"))


def errors(found: DynamicsIdentification) -> np.ndarray:
    stds = [found.estimate.std(name) or np.nan for name in TRUE]
    return (np.array([found.estimate.values[name] for name in TRUE]) - list(TRUE.values())) / stds


def test_it_is_removed_and_said(model: RobotModel) -> None:
    found = [
        identify_dynamics(model, [recorded(k, 2e-6)], flexible=True, friction="classic") for k in range(3)
    ]
    shares = [one.encoders.stiffness["hinge.drive.stiffness"] for one in found if one.encoders is not None]
    assert len(shares) == 3 and min(shares) > -0.15 and max(shares) < -0.01
    assert (
        "positions are rounded to 2e-06 rad, which had reduced hinge.drive.stiffness by" in found[0].summary()
    )
    assert np.abs([errors(one) for one in found]).max() < 3


def test_exact_positions_are_left_alone(model: RobotModel) -> None:
    found = identify_dynamics(model, [recorded(0, 0.0)], flexible=True, friction="classic")
    assert found.encoders is None and "rounded" not in found.summary()


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.0, 1e-6, 2e-6])
def test_intervals_hold(model: RobotModel, step: float) -> None:
    """At 2 µrad 60 % do without the correction."""
    inside = np.abs(over_seeds(of_one_recording, range(100, 140), model, step)) < 1.96
    assert inside.mean() > 0.9
