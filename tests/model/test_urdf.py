"""URDFs against Pinocchio, and with a mistake: one sentence with line, link or joint."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.parts import axis_rotation
from flexcal.model.urdf import locked_joints, pinocchio_model_of, read_urdf

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
    ("</joint>\n  <joint name=\"mount\"", "<joint name=\"mount\"", ["E-URDF-031", "22", "3", "mismatched tag"]),
    ('name="arm"', 'name="arm', ["E-URDF-031", "3", "3"]),
    ('<robot name="arm">', '<robot name="arm"><xacro:include filename="x"/>', ["E-URDF-033", "line 2", "xacro:include", "xacro arm.urdf"]),
    ('<robot name="arm">', '<robot name="arm" xmlns:x="http://www.ros.org/wiki/xacro"><x:arg name="a"/>', ["E-URDF-033", "x:arg"]),
    ('value="4.0"', 'value="${mass}"', ["E-URDF-033", "line 7", "value", "mass"]),
    ('<mass ', '<mass xacro:note="" ', ["E-URDF-033", "line 7", "xacro:note"]),
    ('<robot name="arm">', '<robot name="arm"><visual file="$(find arm)/a.stl"/>', ["E-URDF-033", "line 2", "file"]),
    # inertials
    ('value="4.0"', 'value="4,0"', ["E-URDF-028", "line 7: value", "4,0", "mass", "link 'boom'", "a number"]),
    ('value="4.0"', 'value="heavy"', ["E-URDF-028", "line 7: value", "heavy", "mass", "link 'boom'"]),
    ('value="4.0"', 'value="nan"', ["E-URDF-028", "line 7: value", "nan", "mass", "link 'boom'"]),
    ('value="4.0"', 'value="-4"', ["E-URDF-012", "line 7", "link 'boom'", "-4"]),
    ('<mass value="4.0"/>', "", ["E-URDF-011", "line 5", "link 'boom'"]),
    (INERTIA, 'ixx="big"', ["E-URDF-028", "line 8: ixx", "big", "inertia", "link 'boom'"]),
    (INERTIA, "", ["E-URDF-027", "line 8", "inertia", "link 'boom'", "ixx"]),
    (INERTIA, 'ixx="-0.4"', ["E-URDF-013", "line 8", "link 'boom'"]),
    ('ixy="0"', 'ixy="0.5"', ["E-URDF-013", "line 8", "link 'boom'", "-0.1"]),
    ('xyz="0 0 0.5"', 'xyz="0 0.5"', ["E-URDF-028", "line 6: xyz", "0 0.5", "origin", "link 'boom'", "3 numbers"]),
    # joints
    ('xyz="0 2 0"', 'xyz="0 0 0"', ["E-URDF-017", "line 16", "joint 'shoulder'"]),
    ('xyz="0 2 0"', 'xyz="0 y 0"', ["E-URDF-028", "line 16: xyz", "0 y 0", "axis", "joint 'shoulder'"]),
    ('xyz="0 0 0.3"', 'xyz="0 0 zero"', ["E-URDF-028", "line 15: xyz", "0 0 zero", "origin", "joint 'shoulder'"]),
    ('type="revolute"', 'type="floating"', ["E-URDF-014", "line 12", "'shoulder'", "type 'floating'"]),
    ('type="revolute"', 'type="planar"', ["E-URDF-014", "line 12", "'shoulder'", "type 'planar'"]),
    ('type="revolute"', 'type="ball"', ["E-URDF-014", "line 12", "'shoulder'", "type 'ball'"]),
    (' type="revolute"', "", ["E-URDF-014", "line 12", "'shoulder'", "no type"]),
    (LIMIT, "", ["E-URDF-018", "line 12: joint 'shoulder'", "revolute"]),
    ('lower="-2" upper="2"', "", ["E-URDF-027", "line 17", "limit", "joint 'shoulder'", "lower"]),
    ('upper="2"', 'upper="-2"', ["E-URDF-019", "line 17", "joint 'shoulder'", "-2", "-2"]),
    (' effort="100"', "", ["E-URDF-027", "line 17", "limit", "joint 'shoulder'", "effort"]),
    ('velocity="3"', 'velocity="-0.3"', ["E-URDF-020", "line 17", "velocity", "joint 'shoulder'"]),
    (LIMIT, LIMIT + '<mimic joint="mount"/>', ["E-URDF-042", "line 17", "shoulder", "mount"]),
    # names
    ('<child link="tip"/>', '<child link="top"/>', ["E-URDF-016", "line 21", "child", "joint 'mount'", "top"]),
    ('<parent link="boom"/>', "", ["E-URDF-015", "line 19: joint 'mount'", "parent"]),
    ('<link name="tip"/>', '<link name="boom"/>', ["E-URDF-009", "line 11", "link", "boom", "4"]),
    ('name="mount"', 'name="shoulder"', ["E-URDF-009", "line 19", "joint", "shoulder", "12"]),
    ('<link name="tip"/>', '<link name="tip"/><link name="lost"/>', ["E-URDF-005", "line 2", "base, lost"]),
    ('<child link="tip"/>', '<child link="boom"/>', ["E-URDF-004", "line 19", "mount", "boom", "shoulder"]),
    ('<parent link="base"/>', '<parent link="tip"/>', ["E-URDF-006", "line 4", "boom"]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("right", "wrong", "refusal"), MISTAKES, ids=[" ".join(refusal) for *_, refusal in MISTAKES]
)
def test_one_sentence_with_line_and_name(tmp_path: Path, right: str, wrong: str, refusal: list[str]) -> None:
    assert ARM.count(right) == 1
    (tmp_path / "arm.urdf").write_text(ARM.replace(right, wrong))
    with refused(*refusal) as caught:
        read_urdf(tmp_path / "arm.urdf", {})
    assert str(caught.value).startswith(f"{tmp_path / 'arm.urdf'} line ")
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")


def test_the_sound_file(tmp_path: Path) -> None:
    """A namespace of xacro that expanded files declare is no macro."""
    left = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    (tmp_path / "arm.urdf").write_text(ARM.replace('<robot name="arm">', left))
    found = read_urdf(tmp_path / "arm.urdf", {})
    (joint,) = found.joints
    assert (joint.name, joint.link, joint.lower, joint.upper) == ("shoulder", "boom", -2.0, 2.0)
    np.testing.assert_array_equal(joint.axis, [0, 1, 0])
    assert found.inertias[0].mass == 4.0 and set(found.frames) >= {"boom", "tip", "mount"}


def test_a_robot_without_a_name(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.replace('<robot name="arm">', "<robot>"))
    with refused("E-URDF-022", "line 2", "no name"):
        read_urdf(tmp_path / "arm.urdf", {})


def test_a_joint_and_a_link_of_one_name(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.replace('name="shoulder"', 'name="base"'))
    with refused("E-URDF-023", "arm.urdf", "base"):
        read_urdf(tmp_path / "arm.urdf", {})


def test_a_fixed_joint_of_the_name_of_its_link(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.replace('name="mount"', 'name="tip"'))
    assert read_urdf(tmp_path / "arm.urdf", {}).frames["tip"].joint == 0


@pytest.mark.parametrize("seed", range(20))
def test_any_tree_is_that_of_pinocchio(tmp_path: Path, seed: int) -> None:
    """Placements, inertias and limits of trees with skew joints, some of them locked, against Pinocchio's reduced model."""
    draw = np.random.default_rng(seed)
    urdf, locked = _tree(draw)
    (tmp_path / "tree.urdf").write_text(urdf)
    found = read_urdf(tmp_path / "tree.urdf", locked)
    whole = pin.buildModelFromXML(urdf)
    other = pin.buildReducedModel(whole, *locked_joints(whole, locked))
    assert set(other.names[1:]) == {joint.name for joint in found.joints}
    data = other.createData()
    pin.framesForwardKinematics(other, data, pin.neutral(other))
    placed: list[pin.SE3] = []
    for joint, inertia in zip(found.joints, found.inertias, strict=True):
        number = other.getJointId(joint.name)
        own = pin.SE3(joint.rotation, joint.translation)
        placed.append(placed[joint.parent] * own if joint.parent >= 0 else own)
        np.testing.assert_allclose(placed[-1].homogeneous, data.oMi[number].homogeneous, rtol=0, atol=1e-13)
        theirs = other.inertias[number]
        assert inertia.mass == pytest.approx(theirs.mass, rel=1e-14)
        np.testing.assert_allclose(inertia.com, theirs.lever, rtol=0, atol=1e-13)
        np.testing.assert_allclose(inertia.inertia, theirs.inertia, rtol=0, atol=1e-12)
        if other.joints[number].nq == 1:
            at = other.joints[number].idx_q
            assert (joint.lower, joint.upper) == (other.lowerPositionLimit[at], other.upperPositionLimit[at])
        else:
            assert np.isinf([joint.lower, joint.upper]).all()
        moved = pin.integrate(other, pin.neutral(other), np.eye(other.nv)[other.joints[number].idx_v])
        pin.forwardKinematics(other, data, moved)
        turn = axis_rotation(joint.axis, 1.0) if joint.kind == "revolute" else np.eye(3)
        shift = joint.axis if joint.kind == "prismatic" else np.zeros(3)
        np.testing.assert_allclose(
            (placed[-1] * pin.SE3(turn, shift)).homogeneous, data.oMi[number].homogeneous, rtol=0, atol=1e-13
        )
        pin.forwardKinematics(other, data, pin.neutral(other))
    for name, frame in found.frames.items():
        own = pin.SE3(frame.rotation, frame.translation)
        own = placed[frame.joint] * own if frame.joint >= 0 else own
        theirs = data.oMf[other.getFrameId(name)]
        np.testing.assert_allclose(own.homogeneous, theirs.homogeneous, rtol=0, atol=1e-13)


def _tree(draw: np.random.Generator) -> tuple[str, dict[str, float]]:
    """URDF of a random tree of eight links with one moving joint or more, and the joints to lock."""

    def three(size: float = 1.0) -> str:
        return " ".join(map(str, draw.uniform(-size, size, 3)))

    links, joints, locked = ['<link name="l0"/>'], [], {}
    kinds = ["revolute", *draw.choice(["revolute", "continuous", "prismatic", "fixed"], 6)]
    for k, kind in enumerate(kinds, 1):
        links.append(
            f'<link name="l{k}"><inertial><origin xyz="{three()}" rpy="{three(3)}"/><mass value="{draw.uniform(0, 5)}"/>'
            '<inertia ixx="0.3" ixy="0.02" ixz="-0.03" iyy="0.2" iyz="0.01" izz="0.25"/></inertial></link>'
        )
        limit = '<limit lower="-1" upper="2" effort="9" velocity="3"/>' if kind != "fixed" else ""
        joints.append(
            f'<joint name="j{draw.integers(1000)}_{k}" type="{kind}"><parent link="l{draw.integers(k)}"/><child link="l{k}"/>'
            f'<origin xyz="{three()}" rpy="{three(3)}"/><axis xyz="{three()}"/>{limit}</joint>'
        )
        if kind != "fixed" and k > 1 and draw.random() < 0.4:
            locked[joints[-1].split('"')[1]] = float(draw.uniform(-1, 2))
    draw.shuffle(joints)
    return f'<robot name="tree">{"".join(links)}{"".join(joints)}</robot>', locked


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("<robot name='x'/>", "E-URDF-010"),
        ("<sdf/>", "E-URDF-001"),
        ("<robot name='x'><link name='a'/></robot>", "E-URDF-024"),
    ],
)
def test_files_that_are_no_robot(tmp_path: Path, text: str, code: str) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    with refused(code):
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


def test_what_pinocchio_says_is_one_printable_line(capfd: pytest.CaptureFixture[str]) -> None:
    """It quotes the file, from C++: escape sequences do not reach the terminal, nor do lines that look like others' messages."""
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/><limit effort="1" lower="0" upper="1" velocity="&#10;flexcal: done&#x9b;2J&#x2028;"/></joint></robot>'
    )
    with pytest.raises(ValueError):
        pinocchio_model_of(text)
    said = capfd.readouterr().err
    assert said.count("\n") == 1 and said.startswith("Pinocchio: Error:")
    assert r"flexcal: done\x9b2J" in said and not set("\x9b\u2028") & set(said)
    os.write(2, b"afterwards\n")
    assert capfd.readouterr().err == "afterwards\n"
