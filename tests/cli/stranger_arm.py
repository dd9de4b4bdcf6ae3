"""A simulator that shares nothing with flexcal: arms as products of exponentials in the base frame, whose axes lie elsewhere.

Its URDF has every frame parallel to the base's with the joints at zero, and the axes as they lie. A tracker stands anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

PANDA = [
    ((0, 0, 1), (0, 0, 0.333)), ((0, 1, 0), (0, 0, 0.333)), ((0, 0, 1), (0, 0, 0.649)), ((0, -1, 0), (0.0825, 0, 0.649)),
    ((0, 0, 1), (0, 0, 1.033)), ((0, -1, 0), (0, 0, 1.033)), ((0, 0, -1), (0.088, 0, 1.033)),
]  # fmt: skip
"""Direction and a point (m) of each axis, joints at zero."""
SIX = [
    ((0, 0, 1), (0, 0, 0.4)), ((0, 1, 0), (0.15, 0, 0.45)), ((0, 1, 0), (0.15, 0, 1.05)), ((1, 0, 0), (0.4, 0, 1.2)),
    ((0, 1, 0), (0.75, 0, 1.2)), ((1, 0, 0), (0.8, 0, 1.2)),
]  # fmt: skip


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rodrigues(axis: np.ndarray, angle: float) -> np.ndarray:
    k = skew(axis / np.linalg.norm(axis))
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def turn(vector: np.ndarray) -> np.ndarray:
    size = float(np.linalg.norm(vector))
    return np.eye(3) if size == 0 else rodrigues(vector, size)


def rigid(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    return np.block([[rotation, np.asarray(position)[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])


@dataclass
class StrangerArm:
    """An arm whose axes, zeros and flange are off, with a reflector at `true_xyz` in tool0 that robot.yaml has at `declared_xyz`."""

    seed: int = 0
    axes: tuple = tuple(PANDA)
    declared_xyz: tuple[float, float, float] = (0.05, 0.03, 0.08)
    point_error: tuple[float, float, float] = (0.004, -0.003, 0.0033)
    size: float = 1.0
    tracker_at_base: bool = False

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        n = len(self.axes)
        self.n = n
        self.direction = np.array([a for a, _ in self.axes], dtype=float)
        self.origin = np.array([p for _, p in self.axes], dtype=float)
        last = self.origin[-1] + 0.107 * self.direction[-1]
        facing = turn(np.pi * np.array([1.0, 0, 0])) if self.direction[-1][2] < 0 else np.eye(3)
        self.flange = rigid(facing, last)
        turns = [turn(self.size * 5e-4 * rng.normal(size=3)) for _ in self.direction]
        self.true_direction = np.array([r @ d for r, d in zip(turns, self.direction, strict=True)])
        self.true_origin = self.origin + self.size * 3e-4 * rng.normal(size=(n, 3))
        self.zeros = self.size * 8e-4 * rng.normal(size=n)
        # the flange is turned on the last axis: it goes where that goes, and is centred on it
        carried = rigid(turns[-1], self.true_origin[-1] - turns[-1] @ self.origin[-1])
        own = rigid(turn(self.size * 2e-4 * rng.normal(size=3)), self.size * 3e-5 * rng.normal(size=3))
        self.true_flange = carried @ self.flange @ own
        self.true_xyz = np.array(self.declared_xyz) + np.array(self.point_error)
        self.tracker = (
            np.eye(4)
            if self.tracker_at_base
            else rigid(turn(rng.normal(size=3)), np.array([2.5, -1.0, 0.7]) + rng.normal(size=3))
        )
        self.rng = rng

    def tool(self, q: np.ndarray, *, true: bool) -> np.ndarray:
        """tool0 in the base frame (N, 4, 4)."""
        directions, origins = (
            (self.true_direction, self.true_origin) if true else (self.direction, self.origin)
        )
        found = []
        for row in np.atleast_2d(q) + (self.zeros if true else 0.0):
            at = np.eye(4)
            for angle, d, p in zip(row, directions, origins, strict=True):
                r = rodrigues(d, angle)
                at = at @ rigid(r, p - r @ p)
            found.append(at @ (self.true_flange if true else self.flange))
        return np.array(found)

    def postures(self, count: int, rng: np.random.Generator, spread: float = 1.0) -> np.ndarray:
        """Joint positions (count, n) about a bent posture."""
        centre = {7: [0, -0.3, 0, -1.8, 0, 1.7, 0.5], 6: [0, 0.2, 0.3, 0.1, 0.8, 0.2]}[self.n]
        return np.array(centre) + spread * rng.uniform(-0.9, 0.9, (count, self.n))

    def measured(self, q: np.ndarray, rng: np.random.Generator, sigma: float = 2e-5, tracker=None, xyz=None):
        """The reflector in the tracker's frame (N, 3), with noise."""
        xyz = self.true_xyz if xyz is None else xyz
        at = self.tool(q, true=True) @ np.append(xyz, 1.0)
        seen = (at @ (self.tracker if tracker is None else tracker).T)[:, :3]
        return seen + sigma * rng.normal(size=seen.shape)

    def write(self, folder: Path, more: str = "") -> Path:
        """robot.urdf and robot.yaml."""
        folder.mkdir(parents=True, exist_ok=True)
        links = ['<link name="base"/>']
        joints = []
        was = np.zeros(3)
        for i, (d, p) in enumerate(zip(self.direction, self.origin, strict=True)):
            parent = "base" if i == 0 else f"l{i}"
            links.append(
                f'<link name="l{i + 1}"><inertial><mass value="2"/>'
                '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            )
            xyz, axis = " ".join(map(repr, (p - was).tolist())), " ".join(map(repr, d.tolist()))
            joints.append(
                f'<joint name="a{i + 1}" type="revolute"><parent link="{parent}"/><child link="l{i + 1}"/>'
                f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
                '<limit lower="-3.1" upper="3.1" effort="100" velocity="2"/></joint>'
            )
            was = p
        xyz = " ".join(map(repr, (self.flange[:3, 3] - was).tolist()))
        roll = repr(float(np.pi)) if self.flange[2, 2] < 0 else "0"
        joints.append(
            f'<joint name="mount" type="fixed"><parent link="l{self.n}"/><child link="tool0"/>'
            f'<origin xyz="{xyz}" rpy="{roll} 0 0"/></joint>'
        )
        links.append('<link name="tool0"/>')
        (folder / "arm.urdf").write_text(f'<robot name="stranger">{"".join(links + joints)}</robot>')
        place = ", ".join(map(repr, self.declared_xyz))
        robot = folder / "robot.yaml"
        robot.write_text(
            f"robot: arm.urdf\n# the reflector, with a ruler\npoints:\n  smr: {{frame: tool0, xyz: [{place}]}}   # by hand\n"
            f"geometry: {{terms: [kinematic]}}\n{more}"
        )
        return robot

    def write_poses(self, path: Path, q: np.ndarray, xyz: np.ndarray, sigma: float | None = 2e-5) -> Path:
        """A file of measured poses."""
        header = ["pose", *(f"q{i + 1}" for i in range(self.n)), "x", "y", "z"] + (["sigma"] if sigma else [])
        lines = [",".join(header)]
        for k, (row, point) in enumerate(zip(q, xyz, strict=True)):
            numbers = [*row.tolist(), *point.tolist()] + ([sigma] if sigma else [])
            lines.append(",".join([str(k + 1), *(repr(float(v)) for v in numbers)]))
        path.write_text("\n".join(lines) + "\n")
        return path

    def own_error(self, q: np.ndarray) -> np.ndarray:
        """The robot's own errors (N,) m at `q`: nominal with the true reflector, base placed and reflector moved by brute least squares."""
        from scipy.optimize import least_squares

        truth = (self.tool(q, true=True) @ np.append(self.true_xyz, 1.0))[:, :3]
        nominal = self.tool(q, true=False)

        def left(p: np.ndarray) -> np.ndarray:
            point = (nominal @ np.append(self.true_xyz + p[6:], 1.0))[:, :3]
            return truth - (point @ turn(p[:3]).T + p[3:6])

        found = least_squares(lambda p: left(p).ravel(), np.zeros(9), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        return np.linalg.norm(left(found.x), axis=1)
