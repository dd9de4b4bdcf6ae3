"""A robot that is in no example: six axes of a common build, a gripper whose second finger mimics the first, a flange, no meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import rpy_rotation
from flexcal.model.robot import RobotModel

JOINTS = ("turntable", "shoulder", "elbow", "forearm_roll", "wrist", "flange_roll")
_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
_ORIGINS = ("0 0 0.4", "0.18 0 0.1", "0 0 0.6", "0.3 0 0.12", "0.34 0 0", "0.09 0 0")
_LIMITS = (2.9, 2.0, 2.3, 3.3, 2.1, 6.2)
_INERTIAL = """<inertial><origin xyz="0.05 0 0.1"/><mass value="{0}"/>
<inertia ixx="0.3" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.2"/></inertial>"""
MARK = np.array([0.06, 0.02, 0.08])
"""Where the reflector sits in the frame `flange`, m."""


def urdf_text() -> str:
    """The URDF."""
    parts = ['<link name="base"/>']
    below = "base"
    for i, (name, axis, origin, limit) in enumerate(zip(JOINTS, _AXES, _ORIGINS, _LIMITS, strict=True)):
        parts += [
            f'<link name="link{i + 1}">{_INERTIAL.format(20 - 3 * i)}</link>',
            f'<joint name="{name}" type="revolute"><parent link="{below}"/><child link="link{i + 1}"/><origin xyz="{origin}"/>'
            f'<axis xyz="{axis}"/><limit lower="{-limit}" upper="{limit}" effort="300" velocity="3"/></joint>',
        ]
        below = f"link{i + 1}"
    parts.append(
        '<link name="flange"/><joint name="flange_fixed" type="fixed"><parent link="link6"/><child link="flange"/></joint>'
    )
    for side, mimic in (("left", ""), ("right", '<mimic joint="finger_left"/>')):
        parts.append(
            f'<link name="pad_{side}"/><joint name="finger_{side}" type="prismatic"><parent link="flange"/><child link="pad_{side}"/>'
            f'<axis xyz="0 1 0"/><limit lower="0.01" upper="0.04" effort="5" velocity="1"/>{mimic}</joint>'
        )
    return f'<robot name="newcomer">{"".join(parts)}</robot>'


def true_robot(nominal: RobotModel) -> RobotModel:
    """The robot as it was built: half a milliradian and a third of a millimetre off everywhere."""
    rng = np.random.default_rng(12)
    values = {}
    for joint in nominal.joint_names:
        values |= {
            f"{joint}.{key}": rng.normal(0, 5e-4) for key in ("offset", "misalignment_1", "misalignment_2")
        }
        values |= {f"{joint}.length_{axis}": rng.normal(0, 3e-4) for axis in "xyz"}
    return nominal.with_values(values)


def tracked(robot: RobotModel, q: np.ndarray, seed: int) -> np.ndarray:
    """Points (N, 3), m, that a laser tracker measures at joint positions `q` (N, n), with 0.03 mm of noise a coordinate."""
    position = point_kinematics(true_robot(robot), q, jacobians=False).position
    turned = position @ rpy_rotation(np.array([0.02, -0.03, 2.1])).T + [2.8, 0.4, -0.7]
    return turned + np.random.default_rng(seed).normal(0, 3e-5, turned.shape)


def write_foreign(path: Path, q: np.ndarray, xyz: np.ndarray) -> None:
    """A file as a tracker's program may leave it: semicolons, decimal commas, degrees, millimetres, a remark in every row."""
    lines = [
        "Report of the measurement;;;",
        f"Nr;{';'.join(f'A{i} [°]' for i in range(1, 7))};X (mm);Y (mm);Z (mm);Remark",
    ]
    for i, (joints, point) in enumerate(zip(np.rad2deg(q), 1e3 * xyz, strict=True), start=1):
        numbers = [f"{value:.6f}" for value in joints] + [f"{value:.4f}" for value in point]
        lines.append(f"{i};{';'.join(numbers)};ok".replace(".", ","))
    path.write_bytes("\n".join(lines).encode("cp1252"))
