"""Two links under a position controller, by equations and an integrator of their own.

Spong, Hutchinson & Vidyasagar 2006, section 7.4: two revolute joints in a vertical plane. Steps are those of the leapfrog, with the
damping at their middle (Crank & Nicolson); dry friction is exact in it (a box-constrained complementarity problem of two unknowns, by
Gauss and Seidel), the delayed command is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from flexcal.model.robot import RobotModel

MASS, COM, INERTIA, LENGTH, GRAVITY = (6.0, 3.0), (0.2, 0.18), (0.1, 0.06), 0.4, 9.81
STEP = 2e-4
LINK = """<link name="{name}"><inertial><origin xyz="{com} 0 0"/><mass value="{mass}"/>
<inertia ixx="0.02" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{x} 0 0"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="{effort}" velocity="20"/></joint>"""
LINKS = "".join(
    LINK.format(name=name, mass=MASS[i], com=COM[i], inertia=INERTIA[i])
    for i, name in enumerate(("upper", "lower"))
)
URDF = f"""<robot name="servo_arm"><link name="base"/>{LINKS}
{JOINT.format(name="shoulder", parent="base", child="upper", x=0, effort=400)}
{JOINT.format(name="elbow", parent="upper", child="lower", x=LENGTH, effort=200)}</robot>"""
NAMES = ("shoulder", "elbow")


@dataclass(frozen=True)
class Servo:
    """True actuators, arrays (…, 2): τ = K (u − q) + D (r u̇ − q̇) − d q̇ − f sgn q̇, r being 0 or 1; delay in s; with `balanced` they add what
    holds the links.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    armature: np.ndarray
    delay: np.ndarray
    rate: float = 0.0
    balanced: bool = False

    def values(self) -> dict[str, np.ndarray]:
        return {k: v for k, v in vars(self).items() if k not in ("rate", "balanced")}


TRUTH = Servo(
    stiffness=np.array([900.0, 300.0]),
    damping=np.array([60.0, 20.0]),
    viscous=np.array([6.0, 2.0]),
    coulomb=np.array([4.0, 1.5]),
    armature=np.array([0.8, 0.25]),
    delay=np.array([0.012, 0.012]),
)


def arm(folder: Path, extra: str = "") -> RobotModel:
    (folder / "arm.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text("robot: arm.urdf\n" + extra)
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


def command(seconds: float, rate: float, rng: np.random.Generator) -> np.ndarray:
    """Sines below 1.5 Hz and a step now and then (N, 2), about a posture that gravity loads."""
    time = np.arange(round(seconds * rate)) / rate
    frequency = np.array([0.11, 0.23, 0.41, 0.73, 1.3])
    size = np.array([0.35, 0.25, 0.15, 0.08, 0.05])
    phase = rng.uniform(0, 2 * np.pi, (5, 2))
    smooth = np.einsum(
        "j,tjn->tn", size, np.sin(2 * np.pi * time[:, None, None] * frequency[:, None] + phase)
    )
    at = rng.uniform(0, seconds, (12, 2))
    jump = rng.uniform(-0.1, 0.1, (12, 2))
    steps = np.sum(jump * (time[:, None, None] > at), axis=1)
    return smooth + steps + np.array([0.3, 0.4])


def simulate(servo: Servo, commands: np.ndarray, rate: float, step: float = STEP) -> np.ndarray:
    """Positions (R, N, 2) of R arms at the samples of their commands (R, N, 2), which are interpolated linearly."""
    runs, count, _ = commands.shape
    shaped = {k: np.broadcast_to(v, (runs, 2)) for k, v in servo.values().items()}
    q, v = commands[:, 0].copy(), np.zeros((runs, 2))
    result = np.zeros_like(commands)
    result[:, 0] = q
    many = round(1 / rate / step)
    index, row = np.arange(2)[None, :], np.arange(runs)[:, None]
    impulse = np.zeros((runs, 2))
    for k in range(1, (count - 1) * many + 1):
        late = np.clip(((k - 1) * step - shaped["delay"]) * rate, 0, count - 1.001)
        low = late.astype(int)
        share = late - low
        before, after = commands[row, low, index], commands[row, low + 1, index]
        target = before + share * (after - before)
        speed = (after - before) * rate * servo.rate
        force = shaped["stiffness"] * (target - q) + shaped["damping"] * speed
        cos2, sin2 = np.cos(q[:, 1]), np.sin(q[:, 1])
        cross = MASS[1] * LENGTH * COM[1]
        m22 = INERTIA[1] + MASS[1] * COM[1] ** 2
        m12 = m22 + cross * cos2
        m11 = INERTIA[0] + MASS[0] * COM[0] ** 2 + MASS[1] * LENGTH**2 + m22 + 2 * cross * cos2
        force[:, 0] += cross * sin2 * (2 * v[:, 0] + v[:, 1]) * v[:, 1]
        force[:, 1] -= cross * sin2 * v[:, 0] ** 2
        # about +y, with x along the link at zero, a positive turn lowers it: gravity drives q upwards
        outer = MASS[1] * COM[1] * GRAVITY * np.cos(q.sum(axis=1))
        if not servo.balanced:
            force[:, 0] += (MASS[0] * COM[0] + MASS[1] * LENGTH) * GRAVITY * np.cos(q[:, 0]) + outer
            force[:, 1] += outer
        drag = shaped["damping"] + shaped["viscous"]
        a11 = m11 + shaped["armature"][:, 0] + 0.5 * step * drag[:, 0]
        a22 = m22 + shaped["armature"][:, 1] + 0.5 * step * drag[:, 1]
        moment = force * step
        moment[:, 0] += (a11 - step * drag[:, 0]) * v[:, 0] + m12 * v[:, 1]
        moment[:, 1] += m12 * v[:, 0] + (a22 - step * drag[:, 1]) * v[:, 1]
        bound = step * shaped["coulomb"]
        for _ in range(6):  # impulses of friction that stop the joint, or as far as they go
            free0 = (moment[:, 0] - m12 * v[:, 1]) / a11
            impulse[:, 0] = np.clip(free0 * a11, -bound[:, 0], bound[:, 0])
            v[:, 0] = free0 - impulse[:, 0] / a11
            free1 = (moment[:, 1] - m12 * v[:, 0]) / a22
            impulse[:, 1] = np.clip(free1 * a22, -bound[:, 1], bound[:, 1])
            v[:, 1] = free1 - impulse[:, 1] / a22
        q = q + step * v
        if k % many == 0:
            result[:, k // many] = q
    return result


def write_log(path: Path, time_step: float, commands: np.ndarray, q: np.ndarray) -> None:
    columns = {"t": time_step * np.arange(len(q))}
    columns |= {f"qc{i + 1}": commands[:, i] for i in range(2)} | {f"q{i + 1}": q[:, i] for i in range(2)}
    pl.DataFrame(columns).write_csv(path)
