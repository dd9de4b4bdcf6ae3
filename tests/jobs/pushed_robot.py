"""A column with a balanced lift, a sprung elbow and a wrist that is pushed, in MuJoCo: a robot that shares no code with the identification.

Springs, dampers and armature are MuJoCo's own; the wrench is applied in the world by `mj_applyFT`. Torques come from `mj_inverse`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import polars as pl
from scipy.spatial.transform import Rotation

JOINTS = ("turn", "lift", "elbow", "roll")
SENSOR_XYZ, SENSOR_RPY = (0.05, 0.02, -0.03), (0.3, -0.4, 1.2)
LIFT_STIFFNESS, LIFT_REST = 420.0, 0.55
ELBOW_STIFFNESS, ELBOW_REST = 14.0, -0.8
CABLE = 0.7
"""N m that the motor of the roll joint gives against its cables."""
COULOMB = np.array([2.0, 12.0, 1.5, 0.4])
RATE = 100.0

_URDF = """<robot name="pushed"><link name="base"/>
<link name="column"><inertial><origin xyz="0.02 0.01 0.3"/><mass value="20"/>
<inertia ixx="0.9" iyy="0.8" izz="0.3" ixy="0.02" ixz="0.01" iyz="0"/></inertial></link>
<link name="carriage"><inertial><origin xyz="0.1 0 0.05"/><mass value="9"/>
<inertia ixx="0.1" iyy="0.12" izz="0.09" ixy="0" ixz="0.004" iyz="0"/></inertial></link>
<link name="forearm"><inertial><origin xyz="0.2 0.01 0.02"/><mass value="5"/>
<inertia ixx="0.02" iyy="0.11" izz="0.1" ixy="0" ixz="0.003" iyz="0"/></inertial></link>
<link name="hand"><inertial><origin xyz="0.06 0.03 0.01"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.012" izz="0.009" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
<link name="flange"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="column"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="200" velocity="4"/></joint>
<joint name="lift" type="prismatic"><parent link="column"/><child link="carriage"/><origin xyz="0.1 0 0.3"/><axis xyz="0 0 1"/>
<limit lower="-0.2" upper="0.9" effort="800" velocity="2"/></joint>
<joint name="elbow" type="revolute"><parent link="carriage"/><child link="forearm"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="100" velocity="5"/></joint>
<joint name="roll" type="revolute"><parent link="forearm"/><child link="hand"/><origin xyz="0.4 0 0"/><axis xyz="1 0 0"/>
<limit lower="-6" upper="6" effort="40" velocity="8"/></joint>
<joint name="fixed" type="fixed"><parent link="hand"/><child link="flange"/><origin xyz="0.1 0 0" rpy="0 1.5707963267948966 0"/></joint>
</robot>"""

_MJCF = f"""<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="0 0 -9.81"/><worldbody>
<body name="column" pos="0 0 0.2"><joint name="turn" axis="0 0 1" armature="0.8" damping="3"/>
<inertial pos="0.02 0.01 0.3" mass="22" fullinertia="0.9 0.8 0.35 0.02 0.01 0"/>
<body name="carriage" pos="0.1 0 0.3"><joint name="lift" type="slide" axis="0 0 1" armature="4" damping="60"
 stiffness="{LIFT_STIFFNESS}" springref="{LIFT_REST}"/>
<inertial pos="0.1 0 0.05" mass="10" fullinertia="0.1 0.12 0.09 0 0.004 0"/>
<body name="forearm" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" armature="0.3" damping="1.2"
 stiffness="{ELBOW_STIFFNESS}" springref="{ELBOW_REST}"/>
<inertial pos="0.19 0.01 0.02" mass="5.5" fullinertia="0.02 0.12 0.1 0 0.003 0"/>
<body name="hand" pos="0.4 0 0"><joint name="roll" axis="1 0 0" armature="0.05" damping="0.3"/>
<inertial pos="0.06 0.03 0.01" mass="2.2" fullinertia="0.01 0.012 0.009 0.001 0 0"/>
</body></body></body></body></worldbody></mujoco>"""

_FLANGE = Rotation.from_euler("Y", np.pi / 2)
_PLACE = np.array([0.1, 0, 0]) + _FLANGE.apply(SENSOR_XYZ)
_AXES = (_FLANGE * Rotation.from_euler("xyz", SENSOR_RPY)).as_matrix()
"""Where the sensor is in the hand, and its axes there."""


@dataclass(frozen=True)
class Pushed:
    """A motion at `time` with the `torque` (N, 4) of the motors and the `wrench` (N, 6) on the robot, in the sensor's axes."""

    time: np.ndarray
    q: np.ndarray
    torque: np.ndarray
    wrench: np.ndarray

    def write(
        self, path: Path, *, sign: float = 1.0, wrench: bool = True, noise: float = 0.0, seed: int = 0
    ) -> Path:
        """The log, its torques with relative noise."""
        rng = np.random.default_rng(seed)
        torque = self.torque + noise * self.torque.std(axis=0) * rng.normal(size=self.torque.shape)
        columns = {"t": self.time} | {f"q{i + 1}": self.q[:, i] for i in range(4)}
        columns |= {f"tau{i + 1}": torque[:, i] for i in range(4)}
        if wrench:
            names = ("fx", "fy", "fz", "mx", "my", "mz")
            columns |= {name: sign * self.wrench[:, k] for k, name in enumerate(names)}
        pl.DataFrame(columns).write_csv(path)
        return path


def pushed_model() -> mujoco.MjModel:
    """The arm, its springs, dampers and armature."""
    return mujoco.MjModel.from_xml_string(_MJCF)


def pushed_torque(model: mujoco.MjModel, data: mujoco.MjData, wrench: np.ndarray) -> np.ndarray:
    """Joint torques (4,) of a wrench (6,) on the hand, in the sensor's axes, at the state of `data`."""
    body, found = model.body("hand").id, np.zeros(4)
    turn, force, moment = data.xmat[body].reshape(3, 3), wrench[:3], wrench[3:]
    place, axes = data.xpos[body] + turn @ _PLACE, turn @ _AXES
    mujoco.mj_applyFT(model, data, axes @ force, axes @ moment, place, body, found)
    return found


def pushed(seed: int, duration: float, *, push: float = 1.0, cable: float = CABLE) -> Pushed:
    """A sum of sines, with a wrench of other sines and a contact now and then."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(duration * RATE)) / RATE
    rate = 2 * np.pi * 0.13 * np.array([1, 2, 3, 5, 7])
    reach = np.array([1.0, 0.22, 0.9, 1.5]) / np.array([1, 1.4, 1.8, 3, 4])[:, None]
    size = reach * rng.normal(size=(5, 4)) * 0.6
    angle = time[:, None, None] * rate[:, None] + rng.uniform(0, 2 * np.pi, (5, 4))
    q = np.array([0.0, 0.35, 0.2, 0.0]) + np.sum(size * np.sin(angle), axis=1)
    dq = np.sum(size * rate[:, None] * np.cos(angle), axis=1)
    ddq = -np.sum(size * rate[:, None] ** 2 * np.sin(angle), axis=1)
    tones = 2 * np.pi * np.array([0.21, 0.34, 0.55, 0.71, 0.47, 0.38])
    force = np.array([30, 30, 30, 3, 3, 3]) * np.sin(time[:, None] * tones + rng.uniform(0, 6, 6))
    contact = (np.sin(2 * np.pi * 0.4 * time) > 0.8)[:, None] * np.array([25.0, 0, -40, 0, 2, 0])
    wrench = push * (force + contact)
    model = pushed_model()
    data = mujoco.MjData(model)
    torque = np.empty_like(q)
    for k in range(len(time)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(model, data)
        torque[k] = data.qfrc_inverse - pushed_torque(model, data, wrench[k])
    torque += COULOMB * np.sign(dq)
    torque[:, 3] += cable
    return Pushed(time, q, torque, wrench)


def pushed_yaml(folder: Path, extra: str = "", wrench: str = "on_robot", dynamics: str = "") -> Path:
    """robot.yaml; `dynamics` goes into the block of that name."""
    (folder / "pushed.urdf").write_text(_URDF)
    sensor = (
        f"force_sensor: {{frame: flange, xyz: {list(SENSOR_XYZ)}, rpy: {list(SENSOR_RPY)}, wrench: {wrench}}}\n"
        if wrench
        else ""
    )
    path = folder / "robot.yaml"
    path.write_text(
        "robot: pushed.urdf\n"
        f"dynamics: {{friction: classic, cutoff_hz: 20, decimation: 5{dynamics}}}\n{sensor}{extra}"
    )
    return path


SPRINGS = ", joint_springs: [{joint: lift}, {joint: elbow}], cable_torques: [{joint: roll}]"
KNOWN = (
    f", joint_springs: [{{joint: lift, stiffness: {LIFT_STIFFNESS}, rest: {LIFT_REST}}}, "
    f"{{joint: elbow, stiffness: {ELBOW_STIFFNESS}, rest: {ELBOW_REST}}}], cable_torques: [{{joint: roll, torque: {CABLE}}}]"
)
