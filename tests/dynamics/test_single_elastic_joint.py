"""The single elastic joint of the thesis (Eqs. 2.23-2.25): all eight parameters, and what noise on the arm side does to them."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.data.recordings import Decimation
from flexcal.dynamics.drives import stiffness_attenuation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import (
    BaseParameters,
    Coulomb,
    DriveBacklash,
    DriveSpring,
    Observation,
    RotorInertia,
    Viscous,
)
from flexcal.dynamics.regression import RegressionData, assemble_regression
from flexcal.dynamics.signals import ArmSide, Motion
from flexcal.model.robot import RobotModel

M, FVA, FSA, K, OFFSET, JM, FVM, FSM = 1.7, 0.9, 0.4, 800.0, 2.5, 0.6, 3.0, 1.1
EIGHT = {
    "link.Izz": M,
    "hinge.arm_viscous": FVA,
    "hinge.arm_coulomb": FSA,
    "hinge.drive.stiffness": K,
    "hinge.drive.torque_offset": OFFSET,
    "hinge.rotor_inertia": JM,
    "hinge.viscous": FVM,
    "hinge.coulomb": FSM,
}
URDF = """<robot name="one"><link name="base"/><link name="link"><inertial><mass value="3"/><origin xyz="0.2 0 0"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="20" effort="500"/></joint></robot>"""


@pytest.fixture(scope="module")
def observation(tmp_path_factory: pytest.TempPathFactory) -> Observation:
    folder = tmp_path_factory.mktemp("one")
    (folder / "one.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text(
        "robot: one.urdf\nelastic:\n  - {joint: hinge, drive: {stiffness: 500}}\n"
    )
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    return Observation(model, (RotorInertia(), Viscous(), Coulomb()), (DriveSpring(0),))


@pytest.fixture(scope="module")
def swing() -> Motion:
    """Motor, arm and torque that keep both equations at every instant, with exact derivatives of up to the fourth order."""
    time = np.arange(3000) / 500
    angle = 2 * np.pi * np.array([0.7, 1.9, 4.3]) * time[:, None] + [0.3, 1.1, 2.0]
    rate = 2 * np.pi * np.array([0.7, 1.9, 4.3])
    sizes = np.array([0.8, 0.25, 0.06])
    q, dq, ddq, third, fourth = (
        (sizes * rate**order * np.sin(angle + order * np.pi / 2)).sum(axis=1) for order in range(5)
    )
    side = np.sign(dq)
    motor = q + (M * ddq + FVA * dq + FSA * side - OFFSET) / K
    rate_, push = dq + (M * third + FVA * ddq) / K, ddq + (M * fourth + FVA * third) / K
    torque = JM * push + FVM * rate_ + FSM * np.sign(rate_) - K * (q - motor) + OFFSET
    arm = ArmSide(q[:, None], dq[:, None], ddq[:, None])
    return Motion(time, motor[:, None], rate_[:, None], push[:, None], torque[:, None], arm)


def equations(observation: Observation, motion: Motion) -> RegressionData:
    return assemble_regression(observation, BaseParameters.of(observation), [motion], Decimation(1))


def test_all_eight_parameters(observation: Observation, swing: Motion) -> None:
    found = weighted_least_squares(equations(observation, swing))
    off = {name: abs(found.values[name] / value - 1) for name, value in EIGHT.items()}
    assert max(off.values()) < 1e-8, off
    assert all(found.std(name) is not None for name in EIGHT)
    assert abs(found.values["hinge.drive.damping"]) < 1e-8 * FVM


def test_the_equations_are_those_of_the_thesis(observation: Observation, swing: Motion) -> None:
    """Eq. 2.24, its first row added to the second where both are taken together."""
    assert swing.arm is not None
    q, dq, ddq = (values[:, 0] for values in (swing.arm.q, swing.arm.dq, swing.arm.ddq))
    motor, rate, push = swing.q[:, 0], swing.dq[:, 0], swing.ddq[:, 0]
    one, zero = np.ones_like(q), np.zeros_like(q)
    arm = np.array([ddq, dq, np.sign(dq), q - motor, -one, zero, zero, zero])
    alone = np.array([zero, zero, zero, motor - q, one, push, rate, np.sign(rate)])
    for columns, members, row in zip(
        observation.columns(swing), observation.column_indices, (arm + alone, alone), strict=True
    ):
        shown = {observation.names[m]: c for m, c in zip(members, columns, strict=True)}
        for name, expected in zip(EIGHT, row, strict=True):
            np.testing.assert_allclose(shown.get(name, zero), expected, atol=1e-12)


def test_noise_on_the_arm_side_lowers_the_stiffness_by_what_is_said(
    observation: Observation, swing: Motion
) -> None:
    """Forty recordings whose only error is the arm's encoder: the mean stiffness is low by the share that `stiffness_attenuation` names."""
    rng = np.random.default_rng(5)
    low, said = [], []
    for _ in range(40):
        assert swing.arm is not None
        noisy = replace(swing.arm, q=swing.arm.q + 8e-3 * rng.normal(size=swing.q.shape))
        data = equations(observation, replace(swing, arm=noisy))
        found = weighted_least_squares(data)
        low.append(1 - found.values["hinge.drive.stiffness"] / K)
        said.append(stiffness_attenuation(data, found)["hinge.drive.stiffness"])
    error = np.std(low) / np.sqrt(len(low))
    assert np.mean(low) > 10 * error, (np.mean(low), error)
    assert np.mean(said) == pytest.approx(np.mean(low), abs=3 * error + 0.1 * np.mean(low))


def test_a_gap_seen_from_one_side_is_told_from_nothing(observation: Observation, swing: Motion) -> None:
    """The offset takes it up by name, the stiffness loses nothing, and no gap is assumed for a next pass."""
    (spring,) = observation.springs
    onesided = replace(observation, springs=(replace(spring, backlash=DriveBacklash(-1.0, 0.0)),))
    found = weighted_least_squares(equations(onesided, swing))
    (hidden,) = (entry for entry in found.dropped if entry.name == "hinge.drive.gap_torque")
    assert hidden.absorbed_by == (("hinge.drive.torque_offset", pytest.approx(1.0)),)
    assert found.values["hinge.drive.stiffness"] == pytest.approx(K, rel=1e-8)
    assert spring.with_backlash(observation.model, found.values).backlash == DriveBacklash(
        pytest.approx(OFFSET / K), 0.0
    )


def test_a_motion_without_arm_side_is_refused(observation: Observation, swing: Motion) -> None:
    with refused("E-DYN-018"):
        equations(observation, replace(swing, arm=None))
