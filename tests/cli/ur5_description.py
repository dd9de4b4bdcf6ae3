"""The UR5 of examples/ur5_tracker as a description of ROS: a macro, its kinematics in YAML, ros2_control, and limits for MoveIt."""

from __future__ import annotations

import re
from pathlib import Path

JOINTS = {
    "shoulder_pan_joint": "shoulder",
    "shoulder_lift_joint": "upper_arm",
    "elbow_joint": "forearm",
    "wrist_1_joint": "wrist_1",
    "wrist_2_joint": "wrist_2",
    "wrist_3_joint": "wrist_3",
}
_JOINT = r'<joint name="{}" type="revolute">.*?<origin rpy="([^"]*)" xyz="([^"]*)" />'
_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")


def write_description(urdf: Path, folder: Path) -> Path:
    """Files of the description; returns the main one."""
    text, lines = urdf.read_text(), ["kinematics:"]
    for joint, key in JOINTS.items():
        found = re.search(_JOINT.format(joint), text, re.DOTALL)
        assert found is not None
        numbers = [*found[2].split(), *found[1].split()]
        lines.append(f"  {key}: {{{', '.join(f'{k}: {v}' for k, v in zip(_KEYS, numbers, strict=True))}}}")
        looked = [f"${{kinematics['{key}'].{k}}}" for k in _KEYS]
        origin = f'<origin rpy="{" ".join(looked[3:])}" xyz="{" ".join(looked[:3])}" />'
        text = text.replace(found[0], re.sub(r"<origin [^>]*>", lambda _, new=origin: new, found[0]), 1)
    head, body = re.split(r"<robot name=\"ur5\">", text)
    control = "".join(
        f'    <joint name="{joint}">\n      <command_interface name="position"/>\n    </joint>\n'
        for joint in JOINTS
    )
    main = folder / "urdf" / "ur5.urdf.xacro"
    (folder / "config").mkdir(parents=True)
    main.parent.mkdir()
    (folder / "package.xml").write_text("<package><name>ur5</name></package>\n")
    (folder / "config" / "ur5_kinematics.yaml").write_text("\n".join([*lines, ""]))
    (folder / "config" / "joint_limits.yaml").write_text(
        "joint_limits:\n"
        + "".join(
            f"  {joint}:\n    has_position_limits: true\n    min_position: -3.0\n    max_position: 3.0\n"
            for joint in JOINTS
        )
    )
    main.write_text(
        f'{head}<robot name="ur5" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        '  <xacro:arg name="kinematics" default="../config/ur5_kinematics.yaml"/>\n'
        '  <xacro:macro name="ur5" params="file">\n'
        '  <xacro:property name="kinematics" value="${xacro.load_yaml(file)[\'kinematics\']}"/>'
        + body.replace("</robot>", "  </xacro:macro>")
        + '  <xacro:ur5 file="$(arg kinematics)"/>\n'
        f'  <ros2_control name="ur5" type="system">\n{control}  </ros2_control>\n</robot>\n'
    )
    return main
