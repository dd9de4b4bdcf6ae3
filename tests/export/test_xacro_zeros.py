"""Zeros in ros2_control: the hardware of the test, a stranger to flexcal, adds the offset to what it measures."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refused
from xacro_robots import CONTROLLED, JOINT_LIMITS, expanded, link_poses, write_files

from flexcal.export import XacroSource, measure_export_error, render_xacro, shifted_limits
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel

pytest.importorskip("xacro")

JOINTS = ("pan", "lift", "slide")


@pytest.fixture
def servo(tmp_path: Path) -> RobotModel:
    write_files(tmp_path, {"servo.urdf.xacro": CONTROLLED})
    (tmp_path / "robot.urdf").write_text(expanded(tmp_path / "servo.urdf.xacro"))
    (tmp_path / "robot.yaml").write_text(
        "robot: robot.urdf\npoints:\n  tip: {frame: slide_link, xyz: [0.1, 0, 0]}\n"
    )
    return RobotModel.from_yaml(tmp_path / "robot.yaml")


class Hardware:
    """Joints as a driver has them: it measures from its own zeros, which are not those of the URDF, and knows offsets."""

    def __init__(self, urdf: str) -> None:
        control = ET.fromstring(urdf).find("ros2_control")
        assert control is not None
        params = {
            joint.get("name"): joint.find("param[@name='offset']") for joint in control.findall("joint")
        }
        self.offset = np.array(
            [0.0 if (p := params[name]) is None else float(p.text or "") for name in JOINTS]
        )

    def measured(self, motors: np.ndarray) -> np.ndarray:
        """Positions in ROS."""
        return motors + self.offset

    def command(self, positions: np.ndarray) -> np.ndarray:
        """What the motors are told."""
        return positions - self.offset


def test_measured_positions_give_the_true_pose_and_commands_reach_it(
    servo: RobotModel, tmp_path: Path
) -> None:
    wrong = servo.with_values(
        {"pan.offset": 0.11, "lift.offset": -0.07, "slide.offset": 0.002, "lift.length_x": 0.003}
    )
    source = XacroSource(tmp_path / "servo.urdf.xacro", {}, {})
    before = Hardware(expanded(source.path))
    export = render_xacro(wrong, servo, source, "ros2_control")
    write_files(tmp_path / "new", {p.name: c.decode() for p, c in export.description.contents.items()})
    urdf = expanded(tmp_path / "new" / "servo.urdf.xacro")
    after = Hardware(urdf)
    rng = np.random.default_rng(4)
    for motors in rng.uniform(-0.05, 0.05, (20, 3)):
        # what robot.yaml calls q is what ROS measured when the poses were recorded
        q = before.measured(motors)
        positions = after.measured(motors)
        at = link_poses(urdf, dict(zip(JOINTS, positions, strict=True)))["slide_link"]
        true = point_kinematics(wrong, q[None], jacobians=False)
        np.testing.assert_allclose(at[:3, :3] @ [0.1, 0, 0] + at[:3, 3], true.position[0], atol=1e-9)
        np.testing.assert_allclose(after.command(positions), motors, atol=1e-15)
    error = measure_export_error(wrong, export.tool, ()).error
    assert error is not None and error.max < 1e-9


def test_the_offset_is_in_one_place_and_limits_stay_on_the_arm(servo: RobotModel, tmp_path: Path) -> None:
    wrong = servo.with_values({"pan.offset": 0.1, "lift.offset": -0.05, "slide.offset": 0.002})
    export = render_xacro(wrong, servo, XacroSource(tmp_path / "servo.urdf.xacro", {}, {}), "ros2_control")
    root = ET.fromstring(export.description.expansion.text)
    nominal = ET.fromstring(expanded(tmp_path / "servo.urdf.xacro"))
    offsets = dict(zip(JOINTS, (0.1, -0.05, 0.002), strict=True))
    for joint, was in zip(root.findall("joint"), nominal.findall("joint"), strict=True):
        origins = [e.find("origin") for e in (joint, was)]
        assert origins[0] is not None and origins[1] is not None and origins[0].attrib == origins[1].attrib
        for tag, keys in (
            ("limit", ("lower", "upper")),
            ("safety_controller", ("soft_lower_limit", "soft_upper_limit")),
        ):
            one, other = joint.find(tag), was.find(tag)
            for key in keys if one is not None and other is not None else ():
                assert float(one.get(key)) - float(other.get(key)) == pytest.approx(
                    offsets[joint.get("name")], abs=1e-12
                )
    pan, lift, slide = root.find("ros2_control").findall("joint")
    assert float(pan.find("param[@name='offset']").text) == pytest.approx(0.1)
    assert float(lift.find("param[@name='offset']").text) == pytest.approx(-0.05)
    assert float(slide.find("param[@name='offset']").text) == pytest.approx(0.052)
    assert [float(p.text) for p in pan.find("command_interface")] == pytest.approx([-1.4, 1.6])
    text = next(c for p, c in export.description.contents.items() if p.name == "servo.urdf.xacro").decode()
    assert '<param name="offset">0.1</param>  <!-- rad -->' in text
    assert '<joint name="lift">\n      <param name="offset">-0.05</param>\n      <param name="id">2' in text


def test_a_joint_without_hardware_is_named(servo: RobotModel, tmp_path: Path) -> None:
    path = tmp_path / "servo.urdf.xacro"
    path.write_text(CONTROLLED.replace('<joint name="slide"><param', '<joint name="other"><param'))
    with refused("E-ROS-014", "servo.urdf.xacro", "slide"):
        render_xacro(
            servo.with_values({"slide.offset": 1e-3}), servo, XacroSource(path, {}, {}), "ros2_control"
        )


@pytest.mark.parametrize("given", ["2048", "${'auto'}"])
def test_offsets_in_ticks_are_left_to_the_user(servo: RobotModel, tmp_path: Path, given: str) -> None:
    path = tmp_path / "servo.urdf.xacro"
    path.write_text(CONTROLLED.replace('"offset">0.0<', f'"offset">{given}<'))
    with refused(
        "E-ROS-017", "servo.urdf.xacro", "pan", expanded(path).split('name="offset">')[1].split("<")[0]
    ):
        render_xacro(
            servo.with_values({"pan.offset": 1e-3}), servo, XacroSource(path, {}, {}), "ros2_control"
        )


def test_limits_of_moveit_move_with_the_zeros(tmp_path: Path) -> None:
    path = tmp_path / "joint_limits.yaml"
    content, said, left = shifted_limits(
        path, JOINT_LIMITS.encode(), {"pan": 0.1, "lift": -0.05, "slide": 0.002, "other": 0.0}
    )
    assert content == (
        JOINT_LIMITS.replace("-1.4 ", "-1.2999999999999998 ")
        .replace("position: 1.4", "position: 1.5")
        .replace("-1.5", "-1.55")
        .replace("max_position: 1,", "max_position: 0.95,")
        .encode()
    )
    assert said[0] == "line 6: min_position of pan" and len(said) == 4 and left == ("slide",)
    read = yaml.safe_load(content)["joint_limits"]
    assert read["lift"]["max_position"] == 0.95 and read["slide"]["max_velocity"] == 0.1
    with refused("E-ROS-015", "joint_limits.yaml"):
        shifted_limits(path, b"limits: {pan: {max_position: 1}}\n", {"pan": 0.1})
    with refused("E-ROS-006", "joint_limits.yaml", "3"):
        shifted_limits(path, b"joint_limits:\n  pan: {max_position: 1\n", {"pan": 0.1})
