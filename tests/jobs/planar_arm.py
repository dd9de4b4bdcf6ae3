"""Two links in a vertical plane by Lagrange's equations (Spong): a simulator that shares no code with the package, and writes CSV logs."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

LENGTH, GRAVITY = 0.4, 9.81
URDF = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="6"/>
<inertia ixx="0.02" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0.2 0 0"/><mass value="3"/>
<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-9" upper="9" effort="300" velocity="20"/></joint>
<joint name="j2" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
<limit lower="-9" upper="9" effort="300" velocity="20"/></joint></robot>"""
TRUTH = {
    "upper.mass": 6.6,
    "upper.mc_x": 6.6 * 0.22,
    "upper.mc_z": 6.6 * 0.01,
    "upper.Iyy": 0.12 + 6.6 * (0.22**2 + 0.01**2),
    "lower.mass": 2.8,
    "lower.mc_x": 2.8 * 0.21,
    "lower.mc_z": 2.8 * -0.012,
    "lower.Iyy": 0.055 + 2.8 * (0.21**2 + 0.012**2),
    "j1.rotor_inertia": 0.4,
    "j2.rotor_inertia": 0.1,
    "j1.viscous": 3.0,
    "j1.coulomb": 1.5,
    "j1.torque_offset": 0.5,
    "j2.viscous": 1.0,
    "j2.coulomb": 0.6,
    "j2.torque_offset": -0.3,
}


def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """(N, 2), N m: inertia, gravity, rotors, and viscous, Coulomb and constant friction."""
    x = TRUTH
    cos, sin = np.cos(q[:, 1]), np.sin(q[:, 1])
    coupling = LENGTH * (x["lower.mc_x"] * cos + x["lower.mc_z"] * sin)
    slope = LENGTH * (x["lower.mc_z"] * cos - x["lower.mc_x"] * sin)
    upper = x["upper.Iyy"] + x["lower.mass"] * LENGTH**2 + x["j1.rotor_inertia"]
    lower = x["lower.Iyy"]
    (v1, v2), (a1, a2) = dq.T, ddq.T
    first = (upper + lower + 2 * coupling) * a1 + (lower + coupling) * a2 + slope * (2 * v1 * v2 + v2**2)
    second = (lower + coupling) * a1 + (lower + x["j2.rotor_inertia"]) * a2 - slope * v1**2
    one, both = q[:, 0], q[:, 0] + q[:, 1]
    hung = -GRAVITY * (x["lower.mc_x"] * np.cos(both) + x["lower.mc_z"] * np.sin(both))
    held = -GRAVITY * (
        (x["upper.mc_x"] + x["lower.mass"] * LENGTH) * np.cos(one) + x["upper.mc_z"] * np.sin(one)
    )
    found = np.stack([first + held + hung, second + hung], axis=1)
    for key, column in (("viscous", dq), ("coulomb", np.sign(dq)), ("torque_offset", np.ones_like(dq))):
        found += column * [x[f"j1.{key}"], x[f"j2.{key}"]]
    return found


def swings(duration: float, rate: float, fundamental: float, rng: np.random.Generator) -> list[np.ndarray]:
    """Time (N,), s, and q, q̇ and q̈ (N, 2) of sums of five sines."""
    lines = np.array([1, 2, 3, 5, 7])
    time, omega = np.arange(int(duration * rate)) / rate, 2 * np.pi * fundamental * lines
    size, phase = 1.2 * rng.normal(size=(5, 2)) / np.sqrt(lines)[:, None], rng.uniform(0, 2 * np.pi, (5, 2))
    angle = time[:, None, None] * omega[:, None] + phase
    q, dq = (size * np.sin(angle)).sum(axis=1), (size * omega[:, None] * np.cos(angle)).sum(axis=1)
    return [time, q, dq, -(size * omega[:, None] ** 2 * np.sin(angle)).sum(axis=1)]


def remembering(shape: tuple[int, int], rate: float, memory: float, rng: np.random.Generator) -> np.ndarray:
    """First-order autoregressive noise of unit size with the time constant `memory`, s."""
    decay = np.exp(-1 / (rate * memory)) if memory > 0 else 0.0
    begun = 8 * int(rate * memory)
    white = rng.normal(size=(shape[0] + begun, shape[1]))
    return np.asarray(lfilter([np.sqrt(1 - decay**2)], [1, -decay], white, axis=0))[begun:]


def stribeck(dq: np.ndarray, size: float, velocity: float) -> np.ndarray:
    """Friction (N, 2), N m, that falls off above a `velocity` (rad/s) from its `size` (N m) at the first joint."""
    return size * np.array([1.0, 0.4]) * np.sign(dq) * np.exp(-((dq / velocity) ** 2))


@dataclass(frozen=True)
class Log:
    """A log as it is recorded: noise of positions (rad, white) and of torques (N m at the first joint), with its `memory` (s).

    `stribeck` is the size (N m) of that friction, with its `velocity` (rad/s).
    """

    duration: float = 20.0
    rate: float = 500.0
    fundamental: float = 0.1
    position_noise: float = 0.0
    torque_noise: float = 0.0
    memory: float = 0.0
    stribeck: float = 0.0
    velocity: float = 0.5

    def write(self, folder: Path, seed: int, friction: str = "classic") -> tuple[Path, Path]:
        """robot.yaml, with a CAD that is not the truth, and the log of one motion."""
        rng = np.random.default_rng(seed)
        time, q, dq, ddq = swings(self.duration, self.rate, self.fundamental, rng)
        acted = torque(q, dq, ddq) + stribeck(dq, self.stribeck, self.velocity)
        acted += self.torque_noise * np.array([1.0, 0.4]) * remembering(q.shape, self.rate, self.memory, rng)
        read = q + self.position_noise * rng.normal(size=q.shape)
        (folder / "arm.urdf").write_text(URDF)
        robot, log = folder / "robot.yaml", folder / "log.csv"
        robot.write_text(f"robot: arm.urdf\ndynamics: {{friction: {friction}}}\n")
        table = np.column_stack([time, read, acted])
        np.savetxt(log, table, fmt="%.12g", delimiter=",", header="t,q1,q2,tau1,tau2", comments="")
        return robot, log
