"""Xacro files as people write them, and forward kinematics of a URDF that shares nothing with flexcal."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'

ARITHMETIC = f"""<?xml version="1.0" encoding="utf-8"?>
<!-- An arm whose lengths are properties -->
<robot name="bench" {XMLNS}>
  <xacro:property name="mm" value="0.001"/>
  <xacro:property name="column" value="0.42"/>   <!-- floor to shoulder -->
  <xacro:property name="upper" value="310"/>
  <xacro:property name="reach" value="${{upper * mm}}"/>
  <xacro:property name="fore"  value="0.26" />
  <xacro:arg name="flange" default="0.055"/>

\t<link name="base"/>
  <xacro:macro name="body" params="name">
    <link name="${{name}}">
      <inertial>
        <origin xyz="0 0 0.05"/>
        <mass value="2.0"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
      </inertial>
    </link>
  </xacro:macro>
  <xacro:body name="column_link"/><xacro:body name="upper_link"/>
  <xacro:body name="fore_link"/><xacro:body name="hand_link"/>

  <joint name="turn" type="revolute">
    <origin xyz="0 0 ${{column}}" rpy="0 0 0"/>
    <parent link="base"/><child link="column_link"/>
    <axis xyz="0 0 1"/><limit lower="${{-pi}}" upper="${{pi}}" effort="50" velocity="2"/>
  </joint>
  <joint name="lift" type="revolute">
    <parent link="column_link"/><child link="upper_link"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="2"/>
  </joint>
  <joint name="bend" type="revolute">
    <origin xyz="${{reach}} 0 0"/>
    <parent link="upper_link"/><child link="fore_link"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="2"/>
  </joint>
  <joint name="roll" type="revolute">
    <origin xyz='${{fore - 0.01}} 0 0' rpy='${{pi/2}} 0.0 0'/>
    <parent link="fore_link"/><child link="hand_link"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="50" velocity="2"/>
  </joint>
  <joint name="mount" type="fixed">
    <origin xyz="${{fore + $(arg flange)}} 0 0"/><parent link="hand_link"/><child link="flange"/>
  </joint>
  <link name="flange"/>
</robot>
"""

ARM_MACRO = f"""<?xml version="1.0"?>
<robot {XMLNS}>
  <!-- one joint -->
  <xacro:macro name="axis" params="name parent child kind:=revolute *origin">
    <link name="${{child}}"/>
    <joint name="${{name}}" type="${{kind}}">
      <parent link="${{parent}}"/>
      <child link="${{child}}"/>
      <xacro:insert_block name="origin"/>
      <axis xyz="0 0 1"/>
      <limit lower="-2.8" upper="2.8" effort="87" velocity="2"/>
    </joint>
  </xacro:macro>
  <xacro:macro name="arm" params="side:='' connected_to:=world *mount">
    <xacro:property name="prefix" value="${{side + '_' if side else ''}}"/>
    <link name="${{prefix}}link0"/>
    <joint name="${{prefix}}mount" type="fixed">
      <parent link="${{connected_to}}"/><child link="${{prefix}}link0"/><xacro:insert_block name="mount"/>
    </joint>
    <joint name="${{prefix}}joint1" type="revolute">
      <origin rpy="0 0 0" xyz="0 0 0.333"/>
      <parent link="${{prefix}}link0"/><child link="${{prefix}}link1"/>
      <axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" effort="87" velocity="2"/>
    </joint>
    <link name="${{prefix}}link1"/>
    <joint name="${{prefix}}joint2" type="revolute">
      <origin rpy="${{-pi/2}} 0 0" xyz="0 0 0"/>
      <parent link="${{prefix}}link1"/><child link="${{prefix}}link2"/>
      <axis xyz="0 0 1"/><limit lower="-1.7" upper="1.7" effort="87" velocity="2"/>
    </joint>
    <link name="${{prefix}}link2"/>
    %s
  </xacro:macro>
</robot>
"""
THIRD_BY_MACRO = """<xacro:axis name="${prefix}joint3" parent="${prefix}link2" child="${prefix}link3">
      <origin rpy="${pi/2} 0 0" xyz="0 -0.316 0"/>
    </xacro:axis>"""
THIRD_WRITTEN = """<joint name="${prefix}joint3" type="revolute">
      <parent link="${prefix}link2"/><child link="${prefix}link3"/>
      <axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" effort="87" velocity="2"/>
      <origin rpy="${pi/2} 0 0" xyz="0 -0.316 0"/>
    </joint>
    <link name="${prefix}link3"/>"""
ONE_ARM = f"""<?xml version='1.0'?>
<robot name="one" {XMLNS}>
  <xacro:include filename="../parts/arm.xacro"/>
  <link name="world"/>
  <xacro:arm><origin xyz="0 0 0.1"/></xacro:arm>
</robot>
"""
TWO_ARMS = f"""<?xml version='1.0'?>
<robot name="two" {XMLNS}>
  <xacro:include filename="$(find my_arms)/parts/arm.xacro"/>
  <link name="world"/>
  <xacro:arm side="left"><origin xyz="0 0.3 0.1" rpy="-0.5 0 0"/></xacro:arm>
  <xacro:arm side="right"><origin xyz="0 -0.3 0.1" rpy="0.5 0 0"/></xacro:arm>
</robot>
"""

UR_LIKE = f"""<?xml version="1.0"?>
<robot name="six" {XMLNS}>
  <xacro:arg name="tf_prefix" default=""/>
  <xacro:arg name="kinematics" default="config/default_kinematics.yaml"/>
  <xacro:macro name="read" params="file">
    <xacro:property name="kinematics" value="${{xacro.load_yaml(file)['kinematics']}}" scope="parent"/>
  </xacro:macro>
  <xacro:macro name="six" params="tf_prefix file">
    <xacro:read file="${{file}}"/>
    <link name="${{tf_prefix}}base_link"/>
    <xacro:macro name="placed" params="name parent child key">
      <joint name="${{tf_prefix}}${{name}}_joint" type="revolute">
        <parent link="${{tf_prefix}}${{parent}}"/>
        <child link="${{tf_prefix}}${{child}}" />
        <xacro:property name="p" value="${{kinematics[key]}}"/>
        <origin xyz="${{p['x']}} ${{p['y']}} ${{p['z']}}" rpy="${{p.roll}} ${{p.pitch}} ${{p.yaw}}" />
        <axis xyz="0 0 1" />
        <limit lower="${{-2*pi}}" upper="${{2*pi}}" effort="150" velocity="${{pi}}"/>
      </joint>
      <link name="${{tf_prefix}}${{child}}"/>
    </xacro:macro>
    <xacro:placed name="shoulder_pan" parent="base_link" child="shoulder_link" key="shoulder"/>
    <xacro:placed name="shoulder_lift" parent="shoulder_link" child="upper_arm_link" key="upper_arm"/>
    <xacro:placed name="elbow" parent="upper_arm_link" child="forearm_link" key="forearm"/>
    <xacro:placed name="wrist_1" parent="forearm_link" child="wrist_1_link" key="wrist_1"/>
    <xacro:placed name="wrist_2" parent="wrist_1_link" child="wrist_2_link" key="wrist_2"/>
    <xacro:placed name="wrist_3" parent="wrist_2_link" child="wrist_3_link" key="wrist_3"/>
  </xacro:macro>
  <xacro:six tf_prefix="$(arg tf_prefix)" file="$(arg kinematics)"/>
</robot>
"""
UR_KINEMATICS = """# nominal numbers
kinematics:
  shoulder: {x: 0, y: 0, z: 0.1625, roll: -0, pitch: 0, yaw: 0}
  upper_arm:
    x: 0
    y: 0
    z: 0
    roll: !degrees 90   # about x
    pitch: 0
    yaw: 0
  forearm:
    x: -0.425
    y: 0
    z: 0
    roll: 0
    pitch: 0
    yaw: 0
  wrist_1: {x: -0.3922, y: 0.0, z: 0.1333, roll: 0.0, pitch: 0.0, yaw: 0.0}
  wrist_2: {x: 0, y: -0.0997, z: -2.0448e-11, roll: !degrees 90.0, pitch: 0, yaw: 0}
  wrist_3: {x: 0, y: 0.0996, z: -2.0420e-11, roll: 1.570796326589793, pitch: 3.141592653589793, yaw: 3.141592653589793}
  hash: calib_12788084448423163542
"""


def write_files(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(text.encode())


def expanded(file: Path, *arguments: str) -> str:
    """URDF that the xacro program itself makes of a file."""
    line = [sys.executable, "-c", "import xacro; xacro.main()", file.name, *arguments]
    return subprocess.run(line, cwd=file.parent, check=True, capture_output=True, text=True).stdout


def link_poses(urdf: str, q: dict[str, float]) -> dict[str, np.ndarray]:
    """Poses (4, 4) of all links of a URDF in its root, joints at `q`."""
    root = ET.fromstring(urdf)
    joints = root.findall("joint")
    ends = {joint.attrib["name"]: _ends(joint) for joint in joints}
    children = {child for _, child in ends.values()}
    names = [link.attrib["name"] for link in root.findall("link")]
    poses = {name: np.eye(4) for name in names if name not in children}
    while len(poses) <= len(joints):
        for joint in joints:
            parent, child = ends[joint.attrib["name"]]
            if parent in poses and child not in poses:
                moved = _moved(joint, q.get(joint.attrib["name"], 0.0))
                poses[child] = poses[parent] @ _placed(joint) @ moved
    return poses


def _ends(joint: ET.Element) -> tuple[str, str]:
    parent, child = joint.find("parent"), joint.find("child")
    assert parent is not None and child is not None
    return parent.attrib["link"], child.attrib["link"]


def _placed(joint: ET.Element) -> np.ndarray:
    origin = joint.find("origin")
    texts = [("" if origin is None else origin.get(key, "")) or "0 0 0" for key in ("xyz", "rpy")]
    xyz, (roll, pitch, yaw) = (np.array(text.split(), dtype=float) for text in texts)
    return _translation(xyz) @ _turn([0, 0, 1], yaw) @ _turn([0, 1, 0], pitch) @ _turn([1, 0, 0], roll)


def _moved(joint: ET.Element, q: float) -> np.ndarray:
    if joint.attrib["type"] == "fixed":
        return np.eye(4)
    axis = joint.find("axis")
    direction = np.array((axis.attrib["xyz"] if axis is not None else "1 0 0").split(), dtype=float)
    direction /= np.linalg.norm(direction)
    return _translation(q * direction) if joint.attrib["type"] == "prismatic" else _turn(direction, q)


def _translation(xyz: np.ndarray) -> np.ndarray:
    result = np.eye(4)
    result[:3, 3] = xyz
    return result


def _turn(axis: list[float] | np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=float)
    result = np.eye(4)
    result[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return result


CONTROLLED = f"""<?xml version="1.0"?>
<robot name="servo" {XMLNS}>
  <link name="base"/>
  <xacro:property name="reach" value="0.2"/>
  <joint name="pan" type="revolute">
    <origin xyz="0 0 0.1"/><parent link="base"/><child link="pan_link"/>
    <axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" effort="2" velocity="3"/>
  </joint>
  <link name="pan_link"/>
  <joint name="lift" type="revolute">
    <origin xyz="0 0 0.05"/><parent link="pan_link"/><child link="lift_link"/>
    <axis xyz="0 1 0"/><limit lower="${{-pi/2}}" upper="1.2" effort="2" velocity="3"/>
    <safety_controller soft_lower_limit="-1.4" soft_upper_limit="1.1" k_position="100" k_velocity="10"/>
  </joint>
  <link name="lift_link"/>
  <joint name="slide" type="prismatic">
    <origin xyz="${{reach}} 0 0"/><parent link="lift_link"/><child link="slide_link"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="2" velocity="3"/>
  </joint>
  <link name="slide_link"/>
  <ros2_control name="servos" type="system">
    <hardware><plugin>bus/Servos</plugin></hardware>
    <joint name="pan">
      <param name="id">1</param>
      <param name="offset">0.0</param>  <!-- rad -->
      <command_interface name="position"><param name="min">-1.5</param><param name="max">1.5</param></command_interface>
    </joint>
    <joint name="lift">
      <param name="id">2</param>
      <command_interface name="position"/>
    </joint>
    <joint name="slide"><param name="offset">${{0.1 / 2}}</param></joint>
  </ros2_control>
</robot>
"""
JOINT_LIMITS = """# MoveIt
default_velocity_scaling_factor: 0.1
joint_limits:
  pan:
    has_position_limits: true
    min_position: -1.4   # rad
    max_position: 1.4
    has_velocity_limits: true
    max_velocity: 2.0
  lift: {has_position_limits: true, min_position: -1.5, max_position: 1, max_velocity: 3}
  slide:
    has_velocity_limits: true
    max_velocity: 0.1
"""
