"""A robot before an instrument that measures position and orientation: own kinematics, errors, noise, and ways to write an orientation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

Array = np.ndarray


def turn(axis: Array, angle: float) -> Array:
    """Rotation about an axis (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def any_rotation(rng: np.random.Generator) -> Array:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def fixed_xyz(m: Array) -> Array:
    """Angles about fixed x, y, z: R = Rz(c) Ry(b) Rx(a), as Fanuc's W, P, R."""
    return np.array([np.arctan2(m[2, 1], m[2, 2]), np.arcsin(-m[2, 0]), np.arctan2(m[1, 0], m[0, 0])])


def kuka_abc(m: Array) -> Array:
    return fixed_xyz(m)[::-1]


def turned_xyz(m: Array) -> Array:
    """R = Rx(a) Ry(b) Rz(c), as Stäubli's rx, ry, rz."""
    return np.array([np.arctan2(-m[1, 2], m[2, 2]), np.arcsin(m[0, 2]), np.arctan2(-m[0, 1], m[0, 0])])


def turned_yxz(m: Array) -> Array:
    """R = Ry(b) Rx(a) Rz(c), in the order a, b, c."""
    return np.array([np.arcsin(-m[1, 2]), np.arctan2(m[0, 2], m[2, 2]), np.arctan2(m[1, 0], m[1, 1])])


def turned_zyz(m: Array) -> Array:
    """R = Rz(a) Ry(b) Rz(c), as Kawasaki's O, A, T."""
    return np.array([np.arctan2(m[1, 2], m[0, 2]), np.arccos(m[2, 2]), np.arctan2(m[2, 1], -m[2, 0])])


def turned_zxz(m: Array) -> Array:
    return np.array([np.arctan2(m[0, 2], -m[1, 2]), np.arccos(m[2, 2]), np.arctan2(m[2, 0], m[2, 1])])


def quaternion(m: Array) -> Array:
    """The eigenvector of Bar-Itzhack's matrix, w first, of either sign."""
    k = np.zeros((4, 4))
    k[:3, :3] = m + m.T - np.trace(m) * np.eye(3)
    k[3, :3] = k[:3, 3] = [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]
    k[3, 3] = np.trace(m)
    vector = np.linalg.eigh(k)[1][:, -1]
    return vector[[3, 0, 1, 2]]


def rotation_vector(m: Array) -> Array:
    w, *xyz = quaternion(m)
    xyz, w = np.array(xyz) * np.sign(w), abs(w)
    return 2 * np.arctan2(np.linalg.norm(xyz), w) * xyz / np.linalg.norm(xyz)


@dataclass(frozen=True)
class Arm:
    """Joints by the place of their frames in the one before, (n, 3) and (n, 3, 3); all turn about their z. `tip`: of the last one."""

    xyz: Array
    turns: Array
    tip: Array

    @classmethod
    def any(cls, n: int, rng: np.random.Generator) -> Arm:
        """An articulated arm: axes at right angles or parallel, in turn, with lengths of an ordinary robot."""
        xyz = np.zeros((n, 3))
        lengths = [0.4, 0.1, 0.6, 0.2, 0.5, 0.1, 0.1]
        turns = []
        for i in range(n):
            xyz[i] = rng.uniform(0.3, 1.0) * lengths[i] * np.eye(3)[rng.integers(3)]
            quarter = [0.0, *(np.pi / 2 * rng.choice([-1, 1], n - 1) * (np.arange(1, n) != 2))][i]
            turns.append(turn(np.eye(3)[0], quarter) @ turn(np.eye(3)[2], rng.choice([0, 0.5, np.pi])))
        return cls(xyz, np.array(turns), rng.uniform(0.03, 0.1, 3))

    def wrong(self, rng: np.random.Generator, angle: float, length: float) -> Arm:
        """The same arm with errors (1σ) of every frame."""
        errors = [turn(rng.normal(size=3), rng.normal(0, angle * 3**0.5)) for _ in self.xyz]
        return Arm(
            self.xyz + rng.normal(0, length, self.xyz.shape),
            np.array([t @ e for t, e in zip(self.turns, errors, strict=True)]),
            self.tip + rng.normal(0, length, 3),
        )

    def reach(self, q: Array) -> tuple[Array, Array]:
        """Point (3,) and frame (3, 3) of the tip."""
        place, frame = np.zeros(3), np.eye(3)
        for xyz, own, angle in zip(self.xyz, self.turns, q, strict=True):
            place = place + frame @ xyz
            frame = frame @ own @ turn(np.eye(3)[2], angle)
        return place + frame @ self.tip, frame

    def write(self, folder: Path) -> Path:
        """A robot.yaml and its URDF."""
        links = ['<link name="link_0"/>']
        for i, (xyz, own) in enumerate(zip(self.xyz, self.turns, strict=True), 1):
            rpy = " ".join(repr(float(angle)) for angle in fixed_xyz(own.round(15)))
            at = " ".join(repr(float(value)) for value in xyz)
            links.append(
                f'<link name="link_{i}"/><joint name="axis_{i}" type="revolute"><parent link="link_{i - 1}"/><child link="link_{i}"/>'
                f'<origin xyz="{at}" rpy="{rpy}"/><axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="1" velocity="1"/></joint>'
            )
        (folder / "arm.urdf").write_text(f'<robot name="arm">{"".join(links)}</robot>')
        tip = ", ".join(repr(float(value)) for value in self.tip)
        robot = folder / "robot.yaml"
        robot.write_text(
            f"robot: arm.urdf\npoints:\n  target: {{frame: link_{len(self.xyz)}, xyz: [{tip}]}}\n"
        )
        return robot


@dataclass(frozen=True)
class Cell:
    """Poses: joints (N, n), rad; measured points (N, 3), m, and orientations (N, 3, 3) of the target, in the instrument's frame."""

    arm: Arm
    q: Array
    xyz: Array
    frames: Array

    @classmethod
    def measured(
        cls, n: int, poses: int, seed: int, *, travel: float = 1.5, noise: float = 0.05, error: float = 1e-3
    ) -> Cell:
        """Measured with `noise` (deg, 1σ about each axis; a twentieth of a millimetre) on an arm with errors of `error` rad and m."""
        rng = np.random.default_rng(seed)
        arm = Arm.any(n, rng)
        real = arm.wrong(rng, error, error)
        q = rng.uniform(-1.5, 1.5, n) + rng.uniform(-travel, travel, (poses, n))
        station, tool, origin = any_rotation(rng), any_rotation(rng), rng.uniform(-3, 3, 3)
        xyz, frames = [], []
        for row in q:
            place, frame = real.reach(row)
            shake = turn(rng.normal(size=3), np.deg2rad(noise) * np.linalg.norm(rng.normal(size=3)))
            xyz.append(origin + station @ place + rng.normal(0, 5e-5, 3))
            frames.append(station @ frame @ tool @ shake)
        return cls(arm, q, np.array(xyz), np.array(frames))

    def table(self, names: str, numbers: Array, *, degrees: bool = False) -> str:
        """CSV with the joints in degrees, the points in millimetres, and further columns of `names` (without commas in them)."""
        n = self.q.shape[1]
        numbers = np.rad2deg(numbers) if degrees else numbers
        rows = np.column_stack([np.rad2deg(self.q), 1e3 * self.xyz, numbers])
        header = ",".join([*(f"J{i + 1} [deg]" for i in range(n)), "X [mm]", "Y [mm]", "Z [mm]", names])
        return "\n".join([header, *(",".join(f"{value:.5f}" for value in row) for row in rows)]) + "\n"
