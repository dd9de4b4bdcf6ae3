"""A Delta robot and a tracker, with nothing of flexcal in them: its platform is where three spheres intersect.

Three motors on a ring raise arms, each of which carries two parallel rods with balls at their ends, so that the platform only translates.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from palletiser import turn

RING, ARM, ROD, PLATFORM = 0.2, 0.3, 0.8, 0.06
AROUND = np.array([0.0, 2 * np.pi / 3, -2 * np.pi / 3])
LIMITS = np.array([-0.7, 1.2])
REFLECTOR = np.array([0.0, 0.0, -0.05])
TRACKER = 0.02e-3


@dataclass(frozen=True)
class Delta:
    """One as built: zeros of motors (rad), angles of the arms (rad) and radius of the ring (m), lean of the axes (rad), lengths (m)."""

    zero: np.ndarray
    around: np.ndarray
    ring: np.ndarray
    lean: np.ndarray
    arm: np.ndarray
    rod: np.ndarray

    @classmethod
    def nominal(cls) -> Delta:
        """As drawn."""
        return cls(np.zeros(3), AROUND, np.full(3, RING), np.zeros(3), np.full(3, ARM), np.full(3, ROD))

    @classmethod
    def drawn(cls, seed: int) -> Delta:
        """As built."""
        rng = np.random.default_rng([seed, 9])

        def off(size: float) -> np.ndarray:
            return size * rng.normal(size=3)

        return cls(
            off(3e-3), AROUND + off(2e-3), RING + off(3e-4), off(1e-3), ARM + off(3e-4), ROD + off(5e-4)
        )

    def reflector(self, q: np.ndarray) -> np.ndarray:
        """Where the reflector is (N, 3), m, in the base frame with the motors at `q` (N, 3)."""
        centres = []
        for k in range(3):
            raised = turn(0, self.lean[k]) @ turn(1, q[:, k] + self.zero[k])
            elbow = np.array([self.ring[k], 0, 0]) + raised @ np.array([self.arm[k], 0, 0])
            held = turn(2, AROUND[k])[0] @ np.array([PLATFORM, 0, 0])
            centres.append(elbow @ turn(2, self.around[k])[0].T - held)
        return _spheres(centres, self.rod) + REFLECTOR

    def measured(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """What a tracker in the hall reads (N, 3), m."""
        stand = (turn(2, -1.3) @ turn(1, 0.04))[0]
        return (self.reflector(q) + TRACKER * rng.normal(size=(len(q), 3))) @ stand.T + [1.5, 0.9, 1.6]


def _spheres(centres: list[np.ndarray], radii: np.ndarray) -> np.ndarray:
    """The lower of the two points (N, 3) that three spheres have in common."""
    one, two, three = centres
    x = two - one
    d = np.linalg.norm(x, axis=1)
    x = x / d[:, None]
    i = np.einsum("ni,ni->n", x, three - one)
    y = three - one - i[:, None] * x
    j = np.linalg.norm(y, axis=1)
    y = y / j[:, None]
    a = (radii[0] ** 2 - radii[1] ** 2 + d**2) / (2 * d)
    b = (radii[0] ** 2 - radii[2] ** 2 + i**2 + j**2) / (2 * j) - i / j * a
    z = np.cross(x, y)
    down = -np.sign(z[:, 2])
    height = np.sqrt(radii[0] ** 2 - a**2 - b**2)
    return one + a[:, None] * x + b[:, None] * y + (down * height)[:, None] * z


def poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Motor positions (N, 3) within the limits."""
    low, high = 0.95 * LIMITS
    return rng.uniform(low, high, (count, 3))


def write_robot(folder: Path, more: str = "") -> Path:
    """robot.yaml of the Delta: one arm carries the platform, which relations keep parallel, and loops close those of the others."""
    folder.mkdir(parents=True, exist_ok=True)
    links, joints, frames = ['<link name="base"/>'], [], []

    def joint(
        name: str,
        parent: str,
        child: str,
        xyz: str,
        axis: str,
        rpy: str = "0 0 0",
        limits: str = 'lower="-3" upper="3"',
    ) -> None:
        links.append(f'<link name="{child}"/>')
        joints.append(
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<axis xyz="{axis}"/><limit {limits} effort="100" velocity="5"/></joint>'
        )

    def frame(name: str, parent: str, xyz: str) -> None:
        links.append(f'<link name="{name}"/>')
        frames.append(
            f'<joint name="{name}_fixed" type="fixed"><parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/></joint>'
        )

    for k, angle in enumerate(AROUND, 1):
        place = " ".join(repr(float(v)) for v in turn(2, angle)[0] @ np.array([RING, 0, 0]))
        joint(
            f"motor_{k}",
            "base",
            f"arm_{k}",
            place,
            "0 1 0",
            f"0 0 {float(angle)!r}",
            f'lower="{LIMITS[0]}" upper="{LIMITS[1]}"',
        )
        joint(f"pitch_{k}", f"arm_{k}", f"knuckle_{k}", f"{ARM} 0 0", "0 1 0")
        joint(f"yaw_{k}", f"knuckle_{k}", f"rod_{k}", "0 0 0", "0 0 1")
    joint("level_yaw", "rod_1", "ball", f"{ROD} 0 0", "0 0 1")
    joint("level_pitch", "ball", "platform", "0 0 0", "0 1 0")
    for k in (2, 3):
        at = turn(2, AROUND[k - 1])[0] @ np.array([PLATFORM, 0, 0]) - [PLATFORM, 0, 0]
        frame(f"rod_end_{k}", f"rod_{k}", f"{ROD} 0 0")
        frame(f"ball_{k}", "platform", " ".join(repr(float(v)) for v in at))
    frame("tool", "platform", f"{-PLATFORM} 0 0")
    (folder / "delta.urdf").write_text(f'<robot name="delta">{"".join([*links, *joints, *frames])}</robot>')
    start = float(np.arccos((PLATFORM - RING - ARM) / ROD))
    (folder / "robot.yaml").write_text(
        "robot: delta.urdf\n"
        f"points: {{smr: {{frame: tool, xyz: {REFLECTOR.tolist()}}}}}\n"
        "relations:\n  - {joint: level_yaw, of: {yaw_1: -1.0}}\n  - {joint: level_pitch, of: {pitch_1: -1.0, motor_1: -1.0}}\n"
        "loops:\n"
        f"  second: {{a: rod_end_2, b: ball_2, passive: {{pitch_2: {start:.2f}, yaw_2: 0, pitch_1: {start:.2f}}}}}\n"
        f"  third: {{a: rod_end_3, b: ball_3, passive: {{pitch_3: {start:.2f}, yaw_3: 0, yaw_1: 0}}}}\n"
        "motors: [motor_1, motor_2, motor_3]\n" + more
    )
    return folder / "robot.yaml"
