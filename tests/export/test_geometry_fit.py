"""Geometry that makes up for what a format lacks: closed forms, several arms, and where nothing is to be made up for."""

from __future__ import annotations

from pathlib import Path

import gantry
import numpy as np
from four_bar_arm import write_robot as write_four_bar
from yielding_robot import TWO_ARMS
from yielding_robot import write_robot as write_yielding

from flexcal.export import AT_REST, export_urdf, random_poses, representable_robot
from flexcal.export.representation_error import tool_positions
from flexcal.export.urdf import link_placements, render_urdf
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium


def test_a_gap_that_gravity_closes_on_one_side_is_made_up_for(tx90l: RobotModel) -> None:
    """Where the arm reaches forward it always rests on the same end of the gap of joint 2: with another zero a URDF has that exactly."""
    half = 1e-4
    model = tx90l.without_springs().with_values({"joint_2.backlash": half, "joint_3.length_x": 1e-3})

    def forward(point: str | None, rng: np.random.Generator) -> tuple[np.ndarray, str]:
        return np.array([0.0, 0.8, 0.8, 0.0, 0.0, 0.0]) + rng.uniform(-0.5, 0.5, (500, 6)), "joint range"

    q, _ = forward(None, np.random.default_rng(3))
    assert len(set(static_equilibrium(model, q).flank[:, 1])) == 1
    found, said = representable_robot(model, AT_REST, forward)
    lever = np.linalg.norm(point_kinematics(model, q).geometry_jacobian[:, :3, 6], axis=1)
    plain, made_up = (
        np.linalg.norm(tool_positions(model, q)[0] - point_kinematics(each, q).position, axis=1)
        for each in (model, found)
    )
    np.testing.assert_allclose(plain, half * lever, rtol=1e-3)
    assert said and made_up.max() < 0.01 * plain.mean()


def test_rigid_robots_are_written_as_they_are(tx90l: RobotModel, erroneous, tmp_path: Path) -> None:
    model = erroneous(tx90l.without_springs())
    found, said = representable_robot(model, AT_REST)
    assert found is model and said == ()
    text = export_urdf(model, tmp_path / "robot.urdf").path.read_text()
    assert text.endswith(render_urdf(model).text.partition("\n")[2]) and "In place of" not in text


def test_every_point_of_two_arms_is_nearer(tmp_path: Path) -> None:
    """By Pinocchio, both hands at poses of their own; directions are no worse."""
    robot = write_yielding(tmp_path, TWO_ARMS)
    robot.write_text(
        "robot: robot.urdf\npoints: {left: {frame: l6, xyz: [0.06, 0, 0.1]}, right: {frame: l10, xyz: [0, 0.05, 0.1]}}\n"
    )
    nominal = RobotModel.from_yaml(robot, estimates=False)
    rng = np.random.default_rng(2)
    model = nominal.with_values(
        {f"{name}.gravity_compliance": 2e-5 * rng.uniform(0.5, 1.5) for name in nominal.joint_names}
        | {
            f"{name}.transmission_1_{key}": 2e-4 * rng.normal()
            for name in nominal.joint_names
            for key in ("sin", "cos")
        }
    )
    found, _ = representable_robot(model, AT_REST)
    q, _ = random_poses(model, None, np.random.default_rng(5))
    q, rest = q[:300], static_equilibrium(model, q[:300])
    for point in ("left", "right"):
        true = point_kinematics(model, q, rest.deflection, point=point, jacobians=False)
        off, turned = [], []
        for written in (model, found):
            position, rotation = link_placements(written, render_urdf(written).text, point, q)
            off.append(np.linalg.norm(position - true.position, axis=1).mean())
            turned.append(np.linalg.norm(rotation - true.orientation, axis=(1, 2)).mean())
        assert off[1] < 0.9 * off[0] and turned[1] < turned[0]


def test_slides_take_part(tmp_path: Path) -> None:
    nominal = RobotModel.from_yaml(gantry.write_robot(tmp_path), estimates=False)
    model = nominal.with_values({"x.ratio_x": 2e-4, "c.transmission_1_cos": 1e-3})
    found, _ = representable_robot(model, AT_REST)
    q = gantry.poses(400, np.random.default_rng(4))
    true = tool_positions(model, q)[0]
    off = [
        np.linalg.norm(true - point_kinematics(each, q, jacobians=False).position, axis=1).mean()
        for each in (model, found)
    ]
    assert off[1] < 0.8 * off[0]


def test_a_robot_with_loops_stays_as_calibrated_and_says_so(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_four_bar(tmp_path), estimates=False)
    export = export_urdf(model, tmp_path / "calibrated.urdf")
    assert representable_robot(model, AT_REST)[0] is model
    assert export.lost and "stands as calibrated" in str(export) and "loops" in str(export)
