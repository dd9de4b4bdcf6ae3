"""Static equilibrium against Pinocchio's generalised gravity, its own sensitivities and the sign of backlash."""

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics import elastic_axes, gravity_torque, static_equilibrium
from flexcal.model.vibration import ElasticArm

Q = np.random.default_rng(0).uniform(-2, 2, (30, 6))


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


def test_springs_balance_gravity_in_pinocchio(tx90l: RobotModel) -> None:
    for payload in (0.0, 6.0):
        arm = ElasticArm(tx90l, payload)
        rest = static_equilibrium(tx90l, Q, payload)
        for q, deflection in zip(Q, rest.deflection, strict=True):
            load = pin.computeGeneralizedGravity(arm.model, arm.data, arm.configuration(q, deflection))[
                arm.elastic
            ]
            springs = [tx90l.springs.stiffness[a] * deflection[a] for a in elastic_axes(tx90l)]
            np.testing.assert_allclose(load + springs, 0, atol=1e-9)


def test_gravity_torque_agrees_with_pinocchio(tx90l: RobotModel) -> None:
    other = pin.buildModelFromUrdf(str(tx90l.urdf))
    data = other.createData()
    expected = [pin.computeGeneralizedGravity(other, data, q) for q in Q]
    np.testing.assert_allclose(gravity_torque(tx90l, Q, 0.0), expected, atol=1e-9)


def test_one_newton_step_from_the_undeflected_pose_is_close(tx90l: RobotModel) -> None:
    """One step of (12) from (14) lands within 4e-9 rad of rest."""
    arm = ElasticArm(tx90l, 0.0)
    rest = static_equilibrium(tx90l, Q, 0.0)
    axes = elastic_axes(tx90l)
    springs = np.diag([tx90l.springs.stiffness[a] for a in axes])
    for q, deflection in zip(Q, rest.deflection, strict=True):
        straight = arm.configuration(q, np.zeros((6, 3)))
        load = pin.computeGeneralizedGravity(arm.model, arm.data, straight)[arm.elastic]
        step = -np.linalg.solve(springs + arm.gravity_stiffness(straight), load)
        np.testing.assert_allclose(step, [deflection[a] for a in axes], atol=8e-9)


@pytest.mark.parametrize("name", ["joint_2.drive.stiffness", "joint_1.bearing_y.stiffness"])
def test_compliance_is_the_derivative_by_stiffness(tx90l: RobotModel, name: str) -> None:
    rest = static_equilibrium(tx90l, Q, sensitivities=True)
    axes = elastic_axes(tx90l)
    k = axes.index((tx90l.joint_index(name.split(".")[0]), {"drive": 2, "bearing_y": 1}[name.split(".")[1]]))
    value, step = tx90l.value(name), 1e-4 * tx90l.value(name)
    ends = [static_equilibrium(tx90l.with_values({name: value + s * step}), Q).deflection for s in (1, -1)]
    slope = (ends[0] - ends[1]) / (2 * step)
    expected = -rest.compliance[:, :, k] * rest.deflection[:, axes[k][0], axes[k][1]][:, None]
    got = np.stack([slope[:, j, c] for j, c in axes], axis=1)
    np.testing.assert_allclose(got, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("key", ["mass", "com_x", "com_z"])
def test_regressor_is_the_derivative_by_inertia(tx90l: RobotModel, key: str) -> None:
    rest = static_equilibrium(tx90l, Q, sensitivities=True)
    block = rest.regressor[:, :, 4 * 3 : 4 * 4]
    load = (
        block @ np.concatenate([[1.0], tx90l.links.com[3]])
        if key == "mass"
        else tx90l.links.mass[3] * block[:, :, 1 + "xyz".index(key[-1])]
    )
    expected = -np.einsum("sij,sj->si", rest.compliance, load)
    name, step = f"link_4.{key}", 1e-3
    ends = [
        static_equilibrium(tx90l.with_values({name: tx90l.value(name) + s * step}), Q).deflection
        for s in (1, -1)
    ]
    slope = (ends[0] - ends[1]) / (2 * step)
    got = np.stack([slope[:, j, c] for j, c in elastic_axes(tx90l)], axis=1)
    np.testing.assert_allclose(got, expected, atol=1e-5 * np.abs(expected).max())


def test_the_arm_hangs_to_the_far_side_of_its_backlash(tx90l: RobotModel) -> None:
    """q_arm = q_M - b sign τ: the motor lifts, the arm hangs lower; opening the gap lowers the tool."""
    slack = tx90l.with_values({"joint_2.backlash": 1e-4, "joint_3.backlash": 1e-4})
    loose, tight = static_equilibrium(slack, Q), static_equilibrium(tx90l, Q)
    drop = (
        point_kinematics(slack, Q, loose.deflection).position
        - point_kinematics(tx90l, Q, tight.deflection).position
    )[:, 2]
    clear = np.abs(gravity_torque(tx90l, Q)[:, 1:3]).min(axis=1) > 5
    assert clear.sum() > 20
    assert (drop[clear] < 0).all()
    np.testing.assert_array_equal(loose.flank[:, 1], np.sign(loose.torque[:, 1]))
    assert not loose.flank[:, 0].any()


@pytest.mark.parametrize(("crossing", "hanging"), [(-0.38, False), (2.76, True)])
def test_the_flank_is_the_sign_of_the_torque_at_rest(
    tx90l: RobotModel, crossing: float, hanging: bool
) -> None:
    """Deflected, the upper arm passes upright (or straight down) at another angle than undeflected: that one counts."""
    gap = 4e-5
    loose = tx90l.with_values({"joint_2.backlash": gap, "joint_3.backlash": gap})
    q = np.zeros((4001, 6))
    q[:, 1], q[:, 2] = crossing + np.linspace(-4e-3, 4e-3, 4001), np.pi / 2 - 0.2
    rest = static_equilibrium(loose, q)
    torque, flank = rest.torque[:, 1], rest.flank[:, 1]
    assert {*np.sign(torque)} == {-1, 1}
    assert (np.sign(torque) != np.sign(gravity_torque(loose, q)[:, 1])).sum() > 30
    expected = -torque / loose.value("joint_2.drive.stiffness") - gap * flank
    np.testing.assert_allclose(rest.deflection[:, 1, 2], expected, atol=1e-12)
    across = flank != np.sign(torque)
    if not hanging:
        assert not across.any()
    else:  # within the gap the torque is nothing, and the arm can rest on neither side
        assert np.ptp(q[across, 1]) < 2.2 * gap and np.abs(torque[across]).max() < 0.03


def test_springs_too_weak_for_gravity_are_refused(tx90l: RobotModel) -> None:
    weak = tx90l.with_values({"joint_2.drive.stiffness": 1.0})
    with refused("E-MODEL-006", "springs cannot carry the arm", "drive of joint_2", "by the estimates"):
        static_equilibrium(weak, np.zeros((1, 6)))


def test_a_payload_that_no_spring_carries_is_named_with_what_robot_yaml_declares(tx90l: RobotModel) -> None:
    with refused("E-MODEL-006", "in robot.yaml", "3e+06 kg", "where robot.yaml declares 6"):
        static_equilibrium(tx90l, Q[:1], 3e6)


def test_payload_needs_a_declaration(tx90l: RobotModel) -> None:
    from dataclasses import replace

    with refused("E-MODEL-005"):
        static_equilibrium(replace(tx90l, payload=None), Q, 3.0)
