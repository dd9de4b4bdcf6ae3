"""A seven-axis arm to export: joint origins as in Franka's published URDF, and its published modified DH table."""

from __future__ import annotations

from pathlib import Path

from flexcal.model.robot import RobotModel

ORIGINS = [
    ("0 0 0.333", "0 0 0"),
    ("0 0 0", "-1.5707963267948966 0 0"),
    ("0 -0.316 0", "1.5707963267948966 0 0"),
    ("0.0825 0 0", "1.5707963267948966 0 0"),
    ("-0.0825 0.384 0", "-1.5707963267948966 0 0"),
    ("0 0 0", "1.5707963267948966 0 0"),
    ("0.088 0 0", "1.5707963267948966 0 0"),
]
A = (0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088)
D = (0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.107)
ALPHA_QUARTERS = (0, -1, 1, 1, -1, 1, 1)
"""Of a right angle. D ends at the flange."""

_JOINT = """<joint name="panda_joint{0}" type="revolute"><parent link="panda_link{1}"/><child link="panda_link{0}"/>
  <origin xyz="{2}" rpy="{3}"/><axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" effort="87" velocity="2"/></joint>"""


def panda(folder: Path) -> RobotModel:
    """The arm with a point at its flange, its files in `folder`."""
    links = [f'<link name="panda_link{k}"/>' for k in range(8)]
    joints = [_JOINT.format(k + 1, k, xyz, rpy) for k, (xyz, rpy) in enumerate(ORIGINS)]
    (folder / "panda.urdf").write_text(f'<robot name="panda">{"".join(links + joints)}</robot>')
    robot = folder / "robot.yaml"
    robot.write_text("robot: panda.urdf\npoints:\n  flange_point: {frame: panda_link7, xyz: [0, 0, 0.107]}\n")
    return RobotModel.from_yaml(robot)
