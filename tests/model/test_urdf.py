"""URDFs with a mistake: one sentence with line, link or joint; nothing is dropped that the parser cannot read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.errors import InputError
from flexcal.model.urdf import read_urdf

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="boom">
    <inertial>
      <origin xyz="0 0 0.5" rpy="0 0 0"/>
      <mass value="4.0"/>
      <inertia ixx="0.4" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.1"/>
    </inertial>
  </link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="boom"/>
    <origin xyz="0 0 0.3"/>
    <axis xyz="0 2 0"/>
    <limit lower="-2" upper="2" effort="100" velocity="3"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="boom"/>
    <child link="tip"/>
  </joint>
</robot>
"""

INERTIA, LIMIT = 'ixx="0.4"', '<limit lower="-2" upper="2" effort="100" velocity="3"/>'

MISTAKES = [
    # XML
    ("</joint>\n  <joint name=\"mount\"", "<joint name=\"mount\"", "line 22, column 3: not well-formed XML (mismatched tag)"),
    ('name="arm"', 'name="arm', "line 3, column 3: not well-formed XML"),
    ('<robot name="arm">', '<robot name="arm"><xacro:include filename="x"/>', "line 2: <xacro:include> is xacro"),
    # inertials
    ('value="4.0"', 'value="4,0"', "line 7: value=\"4,0\" in <mass> of link 'boom' is not a number"),
    ('value="4.0"', 'value="heavy"', "line 7: value=\"heavy\" in <mass> of link 'boom'"),
    ('value="4.0"', 'value="nan"', "line 7: value=\"nan\" in <mass> of link 'boom'"),
    ('value="4.0"', 'value="-4"', "line 7: the mass of link 'boom' is -4 kg"),
    ('<mass value="4.0"/>', "", "line 5: <inertial> of link 'boom' needs both <mass> and <inertia>"),
    (INERTIA, 'ixx="big"', "line 8: ixx=\"big\" in <inertia> of link 'boom'"),
    (INERTIA, "", "line 8: <inertia> of link 'boom' lacks the attribute 'ixx'"),
    (INERTIA, 'ixx="-0.4"', "line 8: the inertia of link 'boom' is not positive"),
    ('ixy="0"', 'ixy="0.5"', "line 8: the inertia of link 'boom' is not positive (its least principal moment is -0.1"),
    ('xyz="0 0 0.5"', 'xyz="0 0.5"', "line 6: xyz=\"0 0.5\" in <origin> of link 'boom' is not 3 numbers"),
    # joints
    ('xyz="0 2 0"', 'xyz="0 0 0"', "line 16: the axis of joint 'shoulder' is 0 0 0"),
    ('xyz="0 2 0"', 'xyz="0 y 0"', "line 16: xyz=\"0 y 0\" in <axis> of joint 'shoulder'"),
    ('xyz="0 0 0.3"', 'xyz="0 0 zero"', "line 15: xyz=\"0 0 zero\" in <origin> of joint 'shoulder'"),
    ('type="revolute"', 'type="floating"', "line 12: joint 'shoulder' is of the type 'floating'"),
    ('type="revolute"', 'type="planar"', "line 12: joint 'shoulder' is of the type 'planar'"),
    ('type="revolute"', 'type="ball"', "line 12: joint 'shoulder' is of the type 'ball'"),
    (' type="revolute"', "", "line 12: joint 'shoulder' has no type"),
    (LIMIT, "", "line 12: joint 'shoulder' is revolute but has no limits"),
    ('lower="-2" upper="2"', "", "line 17: <limit> of joint 'shoulder' lacks the attribute 'lower'"),
    ('upper="2"', 'upper="-2"', "line 17: the limits of joint 'shoulder', -2 to -2, leave no range"),
    (' effort="100"', "", "line 17: <limit> of joint 'shoulder' lacks the attribute 'effort'"),
    ('velocity="3"', 'velocity="-3"', "line 17: the velocity limit of joint 'shoulder' is negative"),
    (LIMIT, LIMIT + '<mimic joint="mount"/>', "line 12: joint 'shoulder' mimics another one"),
    # names
    ('<child link="tip"/>', '<child link="top"/>', "line 21: the child of joint 'mount', 'top', is no link"),
    ('<parent link="boom"/>', "", "line 19: joint 'mount' names no parent link"),
    ('<link name="tip"/>', '<link name="boom"/>', "line 11: the link 'boom' stands here and on line 4"),
    ('name="mount"', 'name="shoulder"', "line 19: the joint 'shoulder' stands here and on line 12"),
    ('<link name="tip"/>', '<link name="tip"/><link name="lost"/>', "line 2: the links base, lost are not attached to a joint"),
    ('<child link="tip"/>', '<child link="boom"/>', "line 19: joint 'mount' carries the link 'boom', which joint 'shoulder'"),
    ('<parent link="base"/>', '<parent link="tip"/>', "line 4: the link 'boom' is carried by itself"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"), MISTAKES, ids=[sentence for *_, sentence in MISTAKES]
)
def test_one_sentence_with_line_and_name(tmp_path: Path, right: str, wrong: str, sentence: str) -> None:
    assert ARM.count(right) == 1
    (tmp_path / "arm.urdf").write_text(ARM.replace(right, wrong))
    with pytest.raises(InputError) as caught:
        read_urdf(tmp_path / "arm.urdf", {})
    assert str(caught.value).startswith(f"{tmp_path / 'arm.urdf'} {sentence}")
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")


def test_the_sound_file(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    found = read_urdf(tmp_path / "arm.urdf", {})
    (joint,) = found.joints
    assert (joint.name, joint.link, joint.lower, joint.upper) == ("shoulder", "boom", -2.0, 2.0)
    np.testing.assert_array_equal(joint.axis, [0, 1, 0])
    assert found.inertias[0].mass == 4.0 and set(found.frames) >= {"boom", "tip", "mount"}


def test_what_only_the_parser_sees_is_said_in_its_words(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.replace('<robot name="arm">', "<robot>"))
    with refused("E-URDF-022", "No name given for the robot") as caught:
        read_urdf(tmp_path / "arm.urdf", {})
    assert "\n" not in str(caught.value)


def test_a_joint_and_a_link_of_one_name(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.replace('name="shoulder"', 'name="base"'))
    with refused("E-URDF-023", "arm.urdf", "base"):
        read_urdf(tmp_path / "arm.urdf", {})


@pytest.mark.parametrize("text", ["<robot name='x'/>", "<sdf/>", "<robot name='x'><link name='a'/></robot>"])
def test_files_that_are_no_robot(tmp_path: Path, text: str) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(InputError, match=r"no link|not <robot>|no movable joint"):
        read_urdf(tmp_path / "arm.urdf", {})


def test_an_unlimited_joint_about_a_skew_axis(tmp_path: Path) -> None:
    limited = ARM.replace('<axis xyz="0 2 0"/>', '<axis xyz="0 2 -1"/>')
    assert limited != ARM and 'type="revolute"' in ARM
    (tmp_path / "arm.urdf").write_text(limited)
    (tmp_path / "free.urdf").write_text(limited.replace('type="revolute"', 'type="continuous"'))
    (joint,), (free,) = (read_urdf(tmp_path / name, {}).joints for name in ("arm.urdf", "free.urdf"))
    np.testing.assert_allclose(free.axis, np.array([0, 2, -1]) / np.sqrt(5), rtol=1e-15)
    np.testing.assert_array_equal(free.axis, joint.axis)
    assert np.isinf(free.upper) and free.kind == "revolute"
