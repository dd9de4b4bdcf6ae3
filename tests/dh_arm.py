"""A six-axis arm of Denavit-Hartenberg rows in NumPy, which shares nothing with flexcal: its URDF, and its true points before a tracker."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

DH = np.array(
    [
        [0.0, 0.40, 0.15, -np.pi / 2],
        [0.0, 0.0, 0.60, 0.0],
        [0.0, 0.0, 0.12, -np.pi / 2],
        [0.0, 0.62, 0.0, np.pi / 2],
        [0.0, 0.0, 0.0, -np.pi / 2],
        [0.0, 0.10, 0.0, 0.0],
    ]
)
"""Rows theta, d, a, alpha of the nominal arm, rad and m."""
HOME = np.array([0.0, -1.2, 0.4, 0.2, 0.9, 0.1])
TOOL = np.array([0.03, -0.02, 0.11])


def rz(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def rx(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def ry(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])


def at(x: float, y: float, z: float) -> np.ndarray:
    moved = np.eye(4)
    moved[:3, 3] = x, y, z
    return moved


@dataclass(frozen=True)
class DHArm:
    """True rows, tilts about y (Hayati) and the reflector in the last frame."""

    rows: np.ndarray = field(default_factory=DH.copy)
    tilts: np.ndarray = field(default_factory=lambda: np.zeros(6))
    tool: np.ndarray = field(default_factory=TOOL.copy)

    @classmethod
    def made(cls, seed: int) -> DHArm:
        """An arm as a workshop makes it."""
        rng = np.random.default_rng(seed)
        errors = rng.normal(size=(6, 4)) * [8e-4, 3e-4, 3e-4, 4e-4]
        return cls(DH + errors, 3e-4 * rng.normal(size=6), TOOL + 1e-3 * rng.normal(size=3))

    def turned(self, joint: int, angle: float) -> DHArm:
        """The same arm with another zero of a joint, counted from 1."""
        rows = self.rows.copy()
        rows[joint - 1, 0] += angle
        return replace(self, rows=rows)

    def bumped(self, xyz: tuple[float, float, float]) -> DHArm:
        """The same arm with its reflector moved, m."""
        return replace(self, tool=self.tool + np.array(xyz))

    def grown(self, strain: float) -> DHArm:
        """The same arm with all lengths longer by `strain`."""
        rows = self.rows * np.array([1.0, 1.0 + strain, 1.0 + strain, 1.0])
        return replace(self, rows=rows, tool=self.tool * (1.0 + strain))

    def points(self, q: np.ndarray) -> np.ndarray:
        """The reflector (N, 3) in the base frame."""
        found = np.empty((len(q), 3))
        for k, row in enumerate(q):
            frame = np.eye(4)
            for angle, (theta, d, a, alpha), tilt in zip(row, self.rows, self.tilts, strict=True):
                frame = frame @ rz(angle + theta) @ at(0, 0, d) @ at(a, 0, 0) @ rx(alpha) @ ry(tilt)
            found[k] = (frame @ np.append(self.tool, 1.0))[:3]
        return found


def postures(rng: np.random.Generator, count: int, spread: float = 1.0) -> np.ndarray:
    """Joint positions (count, 6)."""
    return HOME + spread * rng.uniform(-1, 1, (count, 6)) * [1.2, 0.6, 0.6, 1.4, 0.8, 2.0]


def tracked(points: np.ndarray, rng: np.random.Generator, sigma: float) -> np.ndarray:
    """Points in the frame of a tracker that stands anywhere, with noise."""
    place = rz(rng.uniform(-3, 3)) @ ry(0.2 * rng.normal()) @ rx(0.2 * rng.normal())
    place[:3, 3] = rng.normal(size=3) + np.array([2.0, 0.0, 0.0])
    return points @ place[:3, :3].T + place[:3, 3] + sigma * rng.normal(size=points.shape)


def write_robot(folder: Path) -> Path:
    """The nominal arm as robot.urdf and robot.yaml."""
    links = [
        '<link name="base"/>',
        *(f'<link name="link_{k}"/>' for k in range(1, 7)),
        '<link name="flange"/>',
    ]
    joints, origin = [], np.eye(4)
    for k, (_, d, a, alpha) in enumerate(DH, 1):
        parent = "base" if k == 1 else f"link_{k - 1}"
        joints.append(
            f'<joint name="joint_{k}" type="revolute"><parent link="{parent}"/><child link="link_{k}"/>{_origin(origin)}'
            '<axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="100" velocity="2"/></joint>'
        )
        origin = at(0, 0, d) @ at(a, 0, 0) @ rx(alpha)
    joints.append(
        f'<joint name="mount" type="fixed"><parent link="link_6"/><child link="flange"/>{_origin(origin)}</joint>'
    )
    (folder / "robot.urdf").write_text(f'<robot name="dh">{"".join(links + joints)}</robot>')
    robot = folder / "robot.yaml"
    place = ", ".join(map(repr, TOOL.tolist()))
    robot.write_text(
        f"robot: robot.urdf\npoints:\n  smr: {{frame: flange, xyz: [{place}]}}\ngeometry: {{terms: [kinematic]}}\n"
    )
    return robot


def _origin(frame: np.ndarray) -> str:
    xyz, roll = frame[:3, 3], float(np.arctan2(frame[2, 1], frame[2, 2]))
    return f'<origin xyz="{" ".join(map(repr, xyz.tolist()))}" rpy="{roll!r} 0 0"/>'


def write_poses(path: Path, q: np.ndarray, xyz: np.ndarray, sigma: float | None) -> Path:
    """A file of measured poses."""
    header = ["pose", *(f"q{k}" for k in range(1, 7)), "x", "y", "z"] + (["sigma"] if sigma else [])
    lines = [",".join(header)]
    for k, numbers in enumerate(np.hstack([q, xyz]).tolist()):
        lines.append(",".join([str(k), *map(repr, numbers)] + ([repr(sigma)] if sigma else [])))
    path.write_text("\n".join(lines) + "\n")
    return path
