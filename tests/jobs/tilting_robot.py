"""A column and an elbow whose bearings tilt and whose drives yield, in MuJoCo: every tilt is a hinge of its own.

The motion about the joints is prescribed and periodic; the tilts solve their equations of motion by iteration, differentiated as Fourier
series; the motors follow from the torques in the drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import polars as pl

DRIVE = {"turn": 9.0e4, "elbow": 4.0e4}
DRIVE_DAMPING = {"turn": 90.0, "elbow": 40.0}
BEARING = {
    "turn.bearing_x": 3.0e5,
    "turn.bearing_y": 2.2e5,
    "elbow.bearing_x": 8.0e4,
    "elbow.bearing_y": 6.0e4,
}
BEARING_DAMPING = 120.0
ROTOR = np.array([1.1, 0.6])
VISCOUS = np.array([4.0, 2.0])
COULOMB = np.array([3.0, 1.2])
_RATE, _PERIOD = 1000.0, 10.0
_HIGHEST = 12.0
"""Hz, to which the tilts are followed: far beyond the motion, below their resonances."""

_LINK = """<link name="{0}"><inertial><origin xyz="{1} {2} {3}"/><mass value="{4}"/>
<inertia ixx="{5}" iyy="{6}" izz="{7}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
TRUE_LINKS = ((0.04, 0.03, 0.3, 20, 0.9, 0.8, 0.35), (0.3, 0.03, 0.02, 10, 0.05, 0.34, 0.33))
"""Centre of mass, mass and principal moments of inertia of column and forearm, as they are."""
CAD_LINKS = ((0.05, 0.02, 0.3, 18, 0.8, 0.7, 0.3), (0.28, 0.02, 0.01, 9, 0.05, 0.3, 0.3))


def urdf(column: Sequence[float], forearm: Sequence[float]) -> str:
    links = _LINK.format("column", *column) + _LINK.format("forearm", *forearm)
    return f"""<robot name="tilting"><link name="base"/>{links}
<link name="tip"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="column"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="400" velocity="4"/></joint>
<joint name="elbow" type="revolute"><parent link="column"/><child link="forearm"/><origin xyz="0.2 0 0.5"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="300" velocity="5"/></joint>
<joint name="fixed" type="fixed"><parent link="forearm"/><child link="tip"/><origin xyz="0.5 0 0"/></joint></robot>"""


def drawn_links(rng: np.random.Generator) -> list[list[float]]:
    """CAD that is off: masses and moments of inertia by 7 %, centres of mass by 10 mm."""
    return [
        [
            *(np.array(link[:3]) + rng.uniform(-0.0173, 0.0173, 3)),
            link[3] * (share := np.exp(0.07 * rng.normal())),
            *(np.array(link[4:]) * share * np.exp(0.07 * rng.normal())),
        ]
        for link in TRUE_LINKS
    ]


ROBOT = """robot: tilting.urdf
bearings: {bearings}
points: {{smr: {{frame: tip, xyz: [0, 0, 0]}}}}
dynamics: {{friction: classic, cutoff_hz: 100, decimation: 50}}
elastic:
  - {{joint: turn, drive: {{stiffness: 5.0e4}}, bearing_x: {{stiffness: 2.0e5}}, bearing_y: {{stiffness: 2.0e5}}, frame_rpy: [0, 0, 0]}}
  - joint: elbow
    drive: {{stiffness: 5.0e4}}
    bearing_x: {{stiffness: 5.0e4}}
    bearing_y: {{stiffness: 5.0e4}}
    frame_rpy: [-1.5707963267948966, 0, 0]
"""


def _mjcf(order: str) -> str:
    """`order` of the hinges of a joint, from the parent on."""
    turn = {"z": "0 0 1", "y": "0 1 0", "x": "1 0 0"}
    bend = {"z": "0 1 0", "y": "0 0 -1", "x": "1 0 0"}  # the bearing's axes where z is the elbow's
    hinges = ["".join(f'<joint type="hinge" axis="{axes[k]}"/>' for k in order) for axes in (turn, bend)]
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="0 0 -9.81"/><worldbody>
<body name="column" pos="0 0 0.2">{hinges[0]}<inertial pos="0.04 0.03 0.3" mass="20" diaginertia="0.9 0.8 0.35"/>
<body name="forearm" pos="0.2 0 0.5">{hinges[1]}<inertial pos="0.3 0.03 0.02" mass="10" diaginertia="0.05 0.34 0.33"/>
</body></body></worldbody></mujoco>"""


def write_tilting(
    path: Path, seed: int, *, before: bool = False, noise: float = 0.0, tilt_noise: float = 0.0
) -> Path:
    """A log of one period and a half with the arm side and the tilts."""
    rng = np.random.default_rng(seed)
    order = "yxz" if before else "zyx"
    model = mujoco.MjModel.from_xml_string(_mjcf(order))
    data = mujoco.MjData(model)
    joints = [order.index("z"), 3 + order.index("z")]
    tilts = [order.index("x"), order.index("y"), 3 + order.index("x"), 3 + order.index("y")]
    time = np.arange(int(_PERIOD * _RATE)) / _RATE
    rate = 2 * np.pi / _PERIOD * np.array([1, 2, 5, 9, 14])
    reach = np.array([1.0, 0.9]) / np.array([1, 1.6, 3.5, 6, 9])[:, None]
    q = np.array([0.0, 0.4]) + np.einsum(
        "kj,tkj->tj",
        reach * rng.normal(size=(5, 2)),
        np.sin(time[:, None, None] * rate[:, None] + rng.uniform(0, 2 * np.pi, (5, 2))),
    )
    states = np.zeros((len(time), 6))
    states[:, joints] = q
    stiffness = np.array(list(BEARING.values()))
    moved = np.inf
    for _ in range(40):
        force = _inverse(model, data, states)
        line = np.fft.rfft(-force[:, tilts], axis=0)
        omega = 2j * np.pi * np.fft.rfftfreq(len(time), 1 / _RATE)[:, None]
        line[np.abs(omega[:, 0]) > 2 * np.pi * _HIGHEST] = 0.0
        found = np.fft.irfft(line / (stiffness + omega * BEARING_DAMPING), n=len(time), axis=0)
        moved = np.abs(found - states[:, tilts]).max()
        states[:, tilts] = found
        if moved < 1e-14:
            break
    assert moved < 1e-12, moved
    load = _inverse(model, data, states)[:, joints]
    k, d = np.array(list(DRIVE.values())), np.array(list(DRIVE_DAMPING.values()))
    omega = 2j * np.pi * np.fft.rfftfreq(len(time), 1 / _RATE)[:, None]
    theta = q + np.fft.irfft(np.fft.rfft(load, axis=0) / (k + omega * d), n=len(time), axis=0)
    speed, push = _derivative(theta), _derivative(_derivative(theta))
    torque = load + ROTOR * push + VISCOUS * speed + COULOMB * np.sign(speed)
    rows = np.arange(int(1.5 * len(time))) % len(time)
    measured = torque[rows] + noise * torque.std(axis=0) * rng.normal(size=(len(rows), 2))
    seen = states[rows][:, tilts] + tilt_noise * rng.normal(size=(len(rows), 4))
    columns = {"t": np.arange(len(rows)) / _RATE}
    for i in range(2):
        columns |= {f"q{i + 1}": theta[rows, i], f"qa{i + 1}": q[rows, i], f"tau{i + 1}": measured[:, i]}
        columns |= {f"qax{i + 1}": seen[:, 2 * i], f"qay{i + 1}": seen[:, 2 * i + 1]}
    pl.DataFrame(columns).write_parquet(path)
    return path


def _inverse(model: mujoco.MjModel, data: mujoco.MjData, states: np.ndarray) -> np.ndarray:
    speed, push = _derivative(states), _derivative(_derivative(states))
    force = np.empty_like(states)
    for k in range(len(states)):
        data.qpos[:], data.qvel[:], data.qacc[:] = states[k], speed[k], push[k]
        mujoco.mj_inverse(model, data)
        force[k] = data.qfrc_inverse
    return force


def _derivative(values: np.ndarray) -> np.ndarray:
    lines = np.fft.rfft(values, axis=0)
    omega = 2j * np.pi * np.fft.rfftfreq(len(values), 1 / _RATE)[:, None]
    return np.fft.irfft(lines * omega, n=len(values), axis=0)
