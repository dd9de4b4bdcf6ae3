"""Arms with joints to spare, with too few for every orientation, and with two hands."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import minimize

from flexcal.compensation import motor_commands
from flexcal.data.poses import ToolTargets
from flexcal.model.kinematics import joint_ranges, point_kinematics
from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest

JOINT = (
    '<joint name="j{0}" type="revolute"><parent link="l{1}"/><child link="l{0}"/><origin xyz="{2}" rpy="{3}"/>'
    '<axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" effort="1" velocity="1"/></joint>'
)
LINK = (
    '<link name="l{0}"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="3"/>'
    '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>'
)
TURNS = ("0 0 0", "-1.5708 0 0", "1.5708 0 0", "1.5708 0 0", "-1.5708 0 0", "-1.5708 0 0", "1.5708 0 0")
PLACES = ("0 0 0.3", "0 0 0", "0 -0.4 0", "0.05 0 0", "-0.05 0.4 0", "0 0 0", "0.1 0 0")


def arm(folder: Path, joints: int) -> RobotModel:
    """The first joints of a seven-axis arm with one weak drive, and a point off its last axis."""
    links = [LINK.format(i) for i in range(joints + 1)]
    chain = [JOINT.format(i + 1, i, PLACES[i], TURNS[i]) for i in range(joints)]
    (folder / "arm.urdf").write_text(f'<robot name="arm">{"".join(links + chain)}</robot>')
    (folder / "robot.yaml").write_text(
        f"robot: arm.urdf\npoints: {{tip: {{frame: l{joints}, xyz: [0.05, 0.02, 0.2]}}}}\n"
        "elastic: [{joint: j2, drive: {stiffness: 2.0e4}}]\ngeometry: {backlash: [j2]}\n"
    )
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


def real(nominal: RobotModel) -> RobotModel:
    rng = np.random.default_rng(3)
    off = {f"{joint}.offset": 1e-3 * rng.normal() for joint in nominal.joint_names}
    off |= {f"{joint}.length_x": 5e-4 * rng.normal() for joint in nominal.joint_names}
    return nominal.with_values(off | {"j2.backlash": 1e-4})


def targets_at(q: np.ndarray) -> ToolTargets:
    return ToolTargets(np.arange(len(q)), np.full(len(q), "tip"), q)


def test_seven_joints_change_least(tmp_path: Path, rng: np.random.Generator) -> None:
    """Against sequential quadratic programming of the change, with the pose as its constraint."""
    nominal = arm(tmp_path, 7)
    robot = real(nominal)
    q = rng.uniform(-1.2, 1.2, (4, 7))
    found = motor_commands(robot, nominal, targets_at(q))
    assert found.reached.all()
    wanted = point_kinematics(nominal, q)
    for k in range(4):
        flank = tool_at_rest(robot, found.q[[k]], None, np.array(["tip"])).rest.flank

        def away(change: np.ndarray, k: int = k, flank: np.ndarray = flank) -> np.ndarray:
            at = tool_at_rest(robot, (q[k] + change)[None], None, np.array(["tip"]), flank=flank).kinematics
            turn = rotation_vector(wanted.orientation[k] @ at.orientation[0].T)
            return 1e3 * np.concatenate([wanted.position[k] - at.position[0], turn])

        least = minimize(
            lambda change: 1e5 * change @ change,
            np.zeros(7),
            constraints={"type": "eq", "fun": away},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 200},
        )
        assert np.abs(away(found.q[k] - q[k])).max() < 1e-5
        change = np.linalg.norm(found.q[k] - q[k])
        assert change == pytest.approx(np.linalg.norm(least.x), rel=1e-4)
        assert np.abs(least.x).max() > 1e-3


def test_a_spare_joint_makes_up_for_one_at_its_limit(tmp_path: Path) -> None:
    nominal = arm(tmp_path, 7)
    robot = real(nominal)
    q = np.array([[0.3, 0.6, -0.4, 1.1, 0.5, 0.8, 0.2]])
    free = motor_commands(robot, nominal, targets_at(q)).q
    joint = int(np.argmax(free - q))
    limit = float(q[0, joint] + 0.3 * (free - q)[0, joint])
    joints = list(robot.joints)
    joints[joint] = replace(joints[joint], upper=limit)
    held = replace(robot, joints=tuple(joints))
    found = motor_commands(held, nominal, targets_at(q))
    assert found.reached.all() and found.q[0, joint] == pytest.approx(limit, abs=1e-12)
    at = tool_at_rest(held, found.q, None, np.array(["tip"])).kinematics
    wanted = point_kinematics(nominal, q)
    np.testing.assert_allclose(at.position, wanted.position, atol=1e-6)
    np.testing.assert_allclose(at.orientation, wanted.orientation, atol=1e-6)


def test_four_joints_bring_the_point_there_and_turn_the_tool_as_far_as_they_can(tmp_path: Path) -> None:
    nominal = arm(tmp_path, 4)
    robot = real(nominal)
    q = np.array([[0.3, 1.0, 1.9, 1.3], [0.1, -0.5, 0.7, 1.4]])
    found = motor_commands(robot, nominal, targets_at(q))
    wanted = point_kinematics(nominal, q)
    at = tool_at_rest(robot, found.q, None, np.full(2, "tip")).kinematics
    np.testing.assert_allclose(at.position, wanted.position, atol=1e-6)
    free = rotation_vector(np.matmul(wanted.orientation, np.swapaxes(at.orientation, 1, 2)))
    for known in (q, None):
        posed = replace(targets_at(q), q=known, position=wanted.position, rotation=wanted.orientation)
        found = motor_commands(robot, nominal, posed)
        assert found.reached.all()
        at = tool_at_rest(robot, found.q, None, np.full(2, "tip")).kinematics
        np.testing.assert_allclose(at.position, wanted.position, atol=1e-6)
        missed = rotation_vector(np.matmul(wanted.orientation, np.swapaxes(at.orientation, 1, 2)))
        assert (np.linalg.norm(missed, axis=1) < np.linalg.norm(free, axis=1)).all()
        exact = point_kinematics(nominal, motor_commands(nominal, nominal, posed).nominal)
        np.testing.assert_allclose(exact.orientation, wanted.orientation, atol=1e-8)
    tilted = vector_rotation(np.array([0.0, 0.15, 0.15])) @ wanted.orientation
    found = motor_commands(robot, nominal, replace(posed, rotation=tilted))
    assert all(reason.startswith("orientation: an arm of 4 joints") for reason in found.reason)
    nominal = arm(tmp_path, 3)
    at = point_kinematics(nominal, q[:, :3])
    posed = replace(targets_at(q[:, :3]), q=None, position=at.position, rotation=at.orientation)
    with refused("E-COMP-001", "3", "tip"):
        motor_commands(nominal, nominal, posed)


def test_two_hands(tree: RobotModel, tmp_path: Path) -> None:
    """Rows with different points are solved together; the joints that do not move a point stay where they are."""
    (tmp_path / "tree.urdf").write_text(tree.urdf.read_text())
    points = "{hand: {frame: hand, xyz: [0.1, 0.2, 0.1]}, finger: {frame: finger, xyz: [0.2, 0, 0.1]}}"
    (tmp_path / "robot.yaml").write_text(f"robot: tree.urdf\npoints: {points}\n")
    nominal = RobotModel.from_yaml(tmp_path / "robot.yaml", estimates=False)
    robot = nominal.with_values(
        {"to_trunk.offset": 2e-3, "to_slider.length_x": 1e-3, "to_right.length_z": 2e-3}
    )
    q = np.random.default_rng(5).uniform(-0.5, 0.5, (6, nominal.n))
    target = np.array(["hand", "finger"] * 3)
    found = motor_commands(robot, nominal, ToolTargets(np.arange(6), target, q))
    assert found.reached.all()
    for name, still in (("hand", ("to_right", "to_finger")), ("finger", ("to_left", "to_slider", "to_hand"))):
        rows = target == name
        wanted = point_kinematics(nominal, q[rows], point=name).position
        at = point_kinematics(robot, found.q[rows], point=name).position
        np.testing.assert_allclose(at, wanted, atol=1e-6)
        columns = [nominal.joint_index(joint) for joint in still]
        np.testing.assert_array_equal(found.q[rows][:, columns], q[rows][:, columns])


def test_blocks_whose_points_need_other_joints(
    tx90l: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A block with the points of the fourth link alone has no rotations, the next one with those of the tool has; both have rows that
    Newton's steps lose, which are sought together.
    """
    for file in tx90l.path.parent.iterdir():
        if file.suffix in (".yaml", ".urdf"):
            shutil.copy(file, tmp_path)
    description = tmp_path / "robot.yaml"
    first = "smr: {frame: flange, xyz: [0.10, 0.00, 0.15]}"
    text = description.read_text()
    assert first in text
    description.write_text(text.replace(first, first + "\n  elbow: {frame: link_4, xyz: [0.05, 0, 0.1]}"))
    nominal = RobotModel.from_yaml(description, estimates=False)
    robot = nominal.with_values({"joint_2.offset": 5e-3, "joint_3.length_x": 2e-3, "joint_5.offset": -4e-3})
    lower, upper = joint_ranges(nominal)
    q = np.random.default_rng(3).uniform(lower, upper, (48, nominal.n))
    q[::6, 4] = 1e-4
    q[1::6, 2] = upper[2]
    target = np.array(["elbow"] * 20 + ["smr"] * 28)
    targets = ToolTargets(np.arange(48), target, q)
    parts = [targets.subset(slice(0, 20)), targets.subset(slice(20, 48))]
    alone = [motor_commands(robot, nominal, part) for part in parts]
    monkeypatch.setattr("flexcal.compensation.target_commands._BLOCK", 4)
    together = motor_commands(robot, nominal, targets)
    assert not together.reached.all() and together.reached.any()
    for name in ("q", "nominal", "before", "unambiguous", "reason"):
        np.testing.assert_array_equal(
            getattr(together, name), np.concatenate([getattr(one, name) for one in alone])
        )
