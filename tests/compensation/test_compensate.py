"""Commands against the forward map, against other engines and solvers, and where there is none."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import brentq, root

from flexcal.calibration.measurement import predict_measurements
from flexcal.compensation import best_posture, motor_commands
from flexcal.data.plans import PosePlan
from flexcal.data.poses import PoseSet, ToolTargets
from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import Bearings, rotation_vector, vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest
from flexcal.virtual_cell import CellConfig, VirtualCell

MICROMETRE = 1e-6
EASY = np.array([0.3, 0.5, 1.2, 0.4, 0.9, -0.5])
"""A posture of the TX90L far from every singularity, limit and change of flank."""


def targets_at(q: np.ndarray, **others: np.ndarray | None) -> ToolTargets:
    q = np.atleast_2d(q)
    return ToolTargets(pose=np.arange(len(q)), target=np.full(len(q), "smr"), q=q, **others)


def seen_in_base(model: RobotModel, q: np.ndarray, payload: np.ndarray | None) -> np.ndarray:
    """Where the calibration's own forward map puts the reflector, from the instrument's frame back to the base frame."""
    n = len(q)
    poses = PoseSet(
        q=q,
        position=np.zeros((n, 3)),
        sigma=np.ones((n, 3)),
        torque=None,
        payload=payload,
        target=np.full(n, "smr"),
        station=np.full(n, "tracker"),
        temperature=None,
        pose=np.arange(n),
    )
    place = model.stations.pose[0]
    return (predict_measurements(model, poses).position - place[:3]) @ vector_rotation(place[3:])


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_round_trip_is_within_a_micrometre(
    tx90l: RobotModel, real: RobotModel, random_targets: Callable[[int], ToolTargets], bearings: Bearings
) -> None:
    targets, real = random_targets(1000), real.with_bearings(bearings)
    found = motor_commands(real, tx90l, targets)
    done = found.reached & found.unambiguous
    assert done.mean() > 0.8 and found.reached.mean() > 0.96
    assert targets.q is not None and targets.payload is not None
    wanted = point_kinematics(tx90l, targets.q)
    at = seen_in_base(real, found.q[done], targets.payload[done])
    assert np.abs(at - wanted.position[done]).max() < MICROMETRE
    tool = tool_at_rest(real, found.q[done], targets.payload[done], targets.target[done])
    turn = rotation_vector(np.swapaxes(wanted.orientation[done], 1, 2) @ tool.kinematics.orientation)
    assert np.abs(turn).max() < 1e-6
    before = seen_in_base(real, targets.q, targets.payload) - wanted.position
    np.testing.assert_allclose(found.before, np.linalg.norm(before, axis=1), atol=1e-9)
    assert np.median(found.before) > 1e-3


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_axes_that_tilt_under_gravity_are_compensated(
    tx90l: RobotModel, real: RobotModel, random_targets: Callable[[int], ToolTargets], bearings: Bearings
) -> None:
    """With payloads of 0 to 6 kg, whose moments tilt the wrist's axes."""
    tilts = {f"joint_{k}.gravity_compliance_{axis}": 1e-5 for k in (4, 5) for axis in (1, 2)}
    targets, tilting = random_targets(100), real.with_bearings(bearings).with_values(tilts)
    found = motor_commands(tilting, tx90l, targets)
    done = found.reached & found.unambiguous
    assert done.mean() > 0.8 and targets.q is not None and targets.payload is not None
    wanted = point_kinematics(tx90l, targets.q).position[done]
    at = seen_in_base(tilting, found.q[done], targets.payload[done])
    assert np.abs(at - wanted).max() < MICROMETRE
    stiff = seen_in_base(real.with_bearings(bearings), found.q[done], targets.payload[done])
    assert np.linalg.norm(stiff - wanted, axis=1).max() > 50 * MICROMETRE


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_another_engine_puts_the_tool_there(
    tx90l: RobotModel, real: RobotModel, random_targets: Callable[[int], ToolTargets], bearings: Bearings
) -> None:
    """MuJoCo at rest, whose mechanism was built from the same values by other code."""
    robot = real.with_bearings(bearings).with_values(
        {"joint_4.transmission_2_sin": 0.0, "joint_5.gravity_compliance": 0.0, "payload.mass": 6.0}
    )
    targets = replace(random_targets(60), payload=None)
    found = motor_commands(robot, tx90l, targets)
    done = found.reached & found.unambiguous
    plan = PosePlan(q=found.q[done])
    seen = VirtualCell(robot, CellConfig()).noise_free(plan)
    place = robot.stations.pose[0]
    at = (seen - place[:3]) @ vector_rotation(place[3:])
    assert targets.q is not None
    assert np.abs(at - point_kinematics(tx90l, targets.q[done]).position).max() < MICROMETRE


def test_commands_are_those_of_a_solver_by_differences(
    tx90l: RobotModel, real: RobotModel, random_targets: Callable[[int], ToolTargets]
) -> None:
    """MINPACK's hybrid method, target by target, with its own difference quotients."""
    targets = random_targets(12)
    found = motor_commands(real, tx90l, targets)
    assert targets.q is not None and targets.payload is not None
    wanted = point_kinematics(tx90l, targets.q)
    for k in np.flatnonzero(found.reached & found.unambiguous):
        one = slice(k, k + 1)
        held = tool_at_rest(real, found.q[one], targets.payload[one], targets.target[one]).rest.flank

        def away(q: np.ndarray, one: slice = one, held: np.ndarray = held) -> np.ndarray:
            at = tool_at_rest(real, q[None], targets.payload[one], targets.target[one], flank=held).kinematics
            turn = wanted.orientation[one][0] @ at.orientation[0].T
            return np.concatenate([wanted.position[one][0] - at.position[0], rotation_vector(turn)])

        other = root(away, targets.q[k], tol=1e-13)
        np.testing.assert_allclose(
            found.q[k], other.x, atol=1e-6 if np.abs(other.fun).max() > 1e-10 else 1e-8
        )


def test_jacobian_against_differences(real: RobotModel, random_targets: Callable[[int], ToolTargets]) -> None:
    targets = random_targets(8)
    assert targets.q is not None
    waves = {
        "joint_2.transmission_1_sin": 3e-4,
        "joint_2.transmission_2_cos": -2e-4,
        "joint_4.transmission_1_cos": 1e-4,
    }
    robot = real.with_values({"joint_5.gravity_compliance": 0.0} | waves)
    at = tool_at_rest(robot, targets.q, targets.payload, targets.target, jacobians=True)
    jacobian, step = at.command_jacobian(), 1e-6
    for j in range(6):
        ends = [
            tool_at_rest(
                robot,
                targets.q + sign * step * np.eye(6)[j],
                targets.payload,
                targets.target,
                flank=at.rest.flank,
            ).kinematics
            for sign in (1, -1)
        ]
        linear = (ends[0].position - ends[1].position) / (2 * step)
        angular = rotation_vector(ends[0].orientation @ np.swapaxes(ends[1].orientation, 1, 2)) / (2 * step)
        np.testing.assert_allclose(jacobian[:, :, j], np.hstack([linear, angular]), atol=2e-8)


def test_one_by_one_is_all_at_once(
    tx90l: RobotModel, real: RobotModel, random_targets: Callable[[int], ToolTargets]
) -> None:
    targets = random_targets(40)
    together = motor_commands(real, tx90l, targets)
    for k in range(40):
        alone = motor_commands(real, tx90l, targets.subset(slice(k, k + 1)))
        np.testing.assert_allclose(alone.q[0], together.q[k], atol=1e-12)
        assert alone.reason[0] == together.reason[k] and alone.unambiguous[0] == together.unambiguous[k]


def test_the_flank_turns_where_the_torque_does(tx90l: RobotModel, real: RobotModel) -> None:
    """On either side of the posture in which joint_2 carries nothing, the commands for it are a whole gap apart."""

    def at(angles: np.ndarray) -> ToolTargets:
        q = np.tile(EASY, (len(angles), 1))
        q[:, 1] = angles
        return targets_at(q)

    def load(angle: float) -> float:
        command = motor_commands(real, tx90l, at(np.array([angle]))).q
        return float(tool_at_rest(real, command, None, np.array(["smr"])).rest.torque[0, 1])

    crossing = brentq(load, -1.0, 0.5, xtol=1e-10)
    near = crossing + np.linspace(-2e-4, 2e-4, 41)
    targets = at(near)
    commands = motor_commands(real, tx90l, targets)
    assert commands.reached.all() and not commands.unambiguous.any()
    steps = np.diff(commands.q[:, 1] - near)
    turn = int(np.argmax(np.abs(steps)))
    assert abs(steps[turn]) == pytest.approx(2 * real.drives.backlash[1], rel=1e-2)
    assert np.abs(np.delete(steps, turn)).max() < 1e-2 * real.drives.backlash[1]
    pressed = np.where(np.arange(41) <= turn, *np.sign([load(crossing - 0.1), load(crossing + 0.1)]))
    flank = tool_at_rest(real, commands.q, None, targets.target).rest.flank.copy()
    flank[:, 1] = pressed
    there = tool_at_rest(real, commands.q, None, targets.target, flank=flank)
    assert targets.q is not None
    wanted = point_kinematics(tx90l, targets.q).position
    assert np.abs(there.kinematics.position - wanted).max() < MICROMETRE
    np.testing.assert_array_equal(np.sign(there.rest.torque[:, 1]), pressed)
    assert motor_commands(real, tx90l, at(crossing + np.array([-0.2, 0.2]))).unambiguous.all()


def test_a_joint_past_its_limit_is_named(tx90l: RobotModel, real: RobotModel) -> None:
    upper = tx90l.joints[4].upper
    shifted = real.with_values({"joint_5.offset": -5e-3})
    q = np.tile(EASY, (2, 1))
    q[1, 4] = upper
    found = motor_commands(shifted, tx90l, targets_at(q))
    assert found.reached.tolist() == [True, False]
    assert np.isnan(found.q[1]).all()
    assert found.reason[1].startswith("joint limit: joint_5 would be 0.00")
    assert f"past its limit of {upper:.5g} rad" in found.reason[1]


def test_a_singular_wrist_is_named(tx90l: RobotModel, real: RobotModel) -> None:
    q = EASY.copy()
    q[4] = 1e-4
    found = motor_commands(real, tx90l, targets_at(q))
    assert not found.reached[0]
    assert found.reason[0].startswith("singular: joint_4 and joint_6 can move together")


def test_a_stretched_arm_that_is_too_short_is_named(tx90l: RobotModel, real: RobotModel) -> None:
    short = real.with_values({"joint_2.length_z": -2e-3, "joint_3.length_z": -2e-3})
    q = np.array([0.3, 0.5, 0.0, 0.4, 0.9, -0.5])
    found = motor_commands(short, tx90l, targets_at(q))
    assert found.reason[0].startswith("singular: joint_2, joint_3")
    assert "the smallest distance of the tool to the target is " in found.reason[0]


def test_points_alone(tx90l: RobotModel, real: RobotModel, rng: np.random.Generator) -> None:
    """They are reached from a start, with the orientation free; a point beyond the reach is said to be."""
    near = EASY + 0.2 * rng.normal(size=(30, 6))
    position = np.vstack([point_kinematics(tx90l, near).position, [[5.0, 0.0, 1.0]]])
    targets = ToolTargets(pose=np.arange(31), target=np.full(31, "smr"), position=position)
    found = motor_commands(real, tx90l, targets, start=EASY)
    assert found.reached.tolist() == [True] * 30 + [False] and not found.elsewhere[:30].any()
    assert re.fullmatch(
        r"out of reach: the smallest distance of the tool to the target is 3\d{3} mm", found.reason[30]
    )
    sure = np.flatnonzero(found.unambiguous)
    at = seen_in_base(real, found.q[sure], None)
    assert len(sure) > 20 and np.abs(at - position[sure]).max() < MICROMETRE
    change = np.linalg.norm(found.nominal[:30] - EASY, axis=1)
    assert (change <= np.linalg.norm(near - EASY, axis=1) + 1e-3).mean() > 0.9


def test_poses_without_joint_positions_keep_the_configuration(
    tx90l: RobotModel, real: RobotModel, rng: np.random.Generator
) -> None:
    near = EASY + 0.3 * rng.uniform(-1, 1, size=(50, 6))
    wanted = point_kinematics(tx90l, near)
    bare = ToolTargets(
        pose=np.arange(50),
        target=np.full(50, "smr"),
        position=wanted.position,
        rotation=wanted.orientation,
    )
    found = motor_commands(real, tx90l, bare, start=EASY)
    np.testing.assert_allclose(found.nominal, near, atol=1e-7)
    np.testing.assert_allclose(found.q, motor_commands(real, tx90l, targets_at(near)).q, atol=1e-7)


def test_points_of_an_instrument(tx90l: RobotModel, real: RobotModel) -> None:
    """Points and orientations in the tracker's frame come to the same commands as in the base frame."""
    wanted = point_kinematics(tx90l, EASY)
    place = real.stations.pose[0]
    turn = vector_rotation(place[3:])
    seen = ToolTargets(
        pose=np.arange(1),
        target=np.array(["smr"]),
        q=EASY[None],
        position=wanted.position @ turn.T + place[:3],
        rotation=turn @ wanted.orientation,
        station=np.array(["tracker"]),
    )
    np.testing.assert_allclose(
        motor_commands(real, tx90l, seen).q, motor_commands(real, tx90l, targets_at(EASY)).q, atol=1e-9
    )


def test_a_position_given_with_joints_keeps_their_orientation(tx90l: RobotModel, real: RobotModel) -> None:
    at = point_kinematics(tx90l, EASY)
    moved = targets_at(EASY, position=at.position + np.array([0.01, -0.02, 0.03]))
    found = motor_commands(real, tx90l, moved)
    tool = tool_at_rest(real, found.q, None, np.array(["smr"])).kinematics
    np.testing.assert_allclose(tool.position, moved.position, atol=MICROMETRE)
    np.testing.assert_allclose(tool.orientation, at.orientation, atol=1e-6)


def test_best_posture_is_far_from_singular(tx90l: RobotModel) -> None:
    jacobian = point_kinematics(tx90l, best_posture(tx90l)).motion_jacobian[0, :, :, 2]
    assert np.linalg.cond(jacobian) < 20


def test_targets_that_do_not_fit() -> None:
    with refused("E-POSES-032"):
        ToolTargets(pose=np.arange(1), target=np.array(["smr"]))
    with refused("E-POSES-033"):
        targets_at(EASY, rotation=np.eye(3)[None])
    with refused("E-POSES-034", "1, 3"):
        targets_at(EASY, position=np.zeros((2, 3)))
