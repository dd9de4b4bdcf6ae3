"""Robots that yield under gravity, and a tracker before them: plain NumPy and SciPy rotations, nothing of flexcal in it.

Every joint turns by compliance times the gravity moment of all that it carries, about its own axis and about the two across it, which are
fixed to the link that turns; moments are those of the deflected robot, found by repeating both.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

G = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True)
class Body:
    """A link and the joint about z that carries it: parent (-1: the base), place there, mass, centre of mass, range of the joint."""

    parent: int
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]
    mass: float
    com: tuple[float, float, float]
    limits: tuple[float, float]


def _panda_like() -> list[Body]:
    rows = [  # a, alpha, d (modified Denavit-Hartenberg), mass, centre of mass, limits
        (0.0, 0.0, 0.333, 4.5, (0.0, -0.03, -0.12), (-2.6, 2.6)),
        (0.0, -np.pi / 2, 0.0, 3.5, (0.0, -0.07, 0.03), (-1.6, 1.6)),
        (0.0, np.pi / 2, 0.316, 3.2, (0.04, 0.03, -0.06), (-2.6, 2.6)),
        (0.0825, np.pi / 2, 0.0, 3.4, (-0.04, 0.05, 0.03), (-2.9, -0.2)),
        (-0.0825, -np.pi / 2, 0.384, 3.0, (0.0, 0.04, -0.11), (-2.6, 2.6)),
        (0.0, np.pi / 2, 0.0, 1.7, (0.05, -0.01, 0.0), (0.2, 3.5)),
        (0.088, np.pi / 2, 0.0, 1.3, (0.01, 0.01, 0.08), (-2.6, 2.6)),
    ]
    return [
        Body(i - 1, (a, -d * np.sin(alpha), d * np.cos(alpha)), (alpha, 0.0, 0.0), mass, com, limits)
        for i, (a, alpha, d, mass, com, limits) in enumerate(rows)
    ]


def _ur_like() -> list[Body]:
    half = np.pi / 2
    rows = [  # place and orientation of the joint, mass, centre of mass, limits
        ((0.0, 0.0, 0.089), (0.0, 0.0, 0.0), 3.7, (0.0, -0.02, 0.0), (-3.1, 3.1)),
        ((0.0, 0.0, 0.0), (half, 0.0, 0.0), 8.4, (-0.2, 0.0, 0.12), (-3.1, 0.0)),
        ((-0.425, 0.0, 0.0), (0.0, 0.0, 0.0), 2.3, (-0.17, 0.0, 0.03), (-2.6, 2.6)),
        ((-0.392, 0.0, 0.109), (0.0, 0.0, 0.0), 1.2, (0.0, -0.02, 0.0), (-3.1, 3.1)),
        ((0.0, -0.095, 0.0), (half, 0.0, 0.0), 1.2, (0.0, 0.02, 0.0), (-3.1, 3.1)),
        ((0.0, 0.082, 0.0), (-half, 0.0, 0.0), 0.2, (0.0, 0.0, -0.02), (-3.1, 3.1)),
    ]
    return [Body(i - 1, *row) for i, row in enumerate(rows)]


def _tx90l_like() -> list[Body]:
    half = np.pi / 2
    rows = [
        ((0.0, 0.0, 0.478), (0.0, 0.0, 0.0), 30.0, (0.0, 0.02, -0.05), (-3.1, 3.1)),
        ((0.05, 0.05, 0.0), (-half, 0.0, 0.0), 35.0, (0.2, 0.0, 0.1), (-2.1, 2.1)),
        ((0.5, 0.0, 0.0), (0.0, 0.0, 0.0), 20.0, (0.0, 0.03, 0.0), (-2.5, 2.5)),
        ((0.0, 0.0, 0.0), (half, 0.0, 0.0), 12.0, (0.0, 0.0, 0.25), (-4.7, 4.7)),
        ((0.0, 0.0, 0.55), (-half, 0.0, 0.0), 3.0, (0.0, -0.02, 0.0), (-2.0, 2.2)),
        ((0.0, 0.0, 0.0), (half, 0.0, 0.0), 0.6, (0.0, 0.0, 0.07), (-4.7, 4.7)),
    ]
    return [Body(i - 1, *row) for i, row in enumerate(rows)]


def _two_arms() -> list[Body]:
    """A waist that turns and bends, and two arms of four joints each on the torso."""
    half = np.pi / 2
    bodies = [
        Body(-1, (0.0, 0.0, 0.9), (0.0, 0.0, 0.0), 4.0, (0.0, 0.01, 0.05), (-1.2, 1.2)),
        Body(0, (0.0, 0.0, 0.1), (-half, 0.0, 0.0), 12.0, (0.01, -0.2, 0.0), (-0.3, 0.5)),
    ]
    for side in (1.0, -1.0):
        first = len(bodies)
        bodies += [
            Body(1, (0.0, -0.4, 0.18 * side), (0.0, 0.0, 0.0), 1.6, (0.0, 0.01, 0.03 * side), (-1.5, 1.5)),
            Body(first, (0.0, 0.0, 0.06 * side), (half, 0.0, 0.0), 2.1, (0.0, -0.02, -0.1), (-1.0, 1.0)),
            Body(first + 1, (0.0, 0.0, -0.28), (0.0, half, 0.0), 1.2, (-0.05, 0.0, 0.02), (-2.0, 2.0)),
            Body(first + 2, (0.0, 0.0, 0.05), (half, 0.0, 0.0), 1.1, (0.02, 0.0, -0.12), (-2.0, 2.0)),
        ]
    return bodies


PANDA_LIKE = tuple(_panda_like())
UR_LIKE = tuple(_ur_like())
TX90L_LIKE = tuple(_tx90l_like())
TWO_ARMS = tuple(_two_arms())
CARRIER = {PANDA_LIKE: 6, UR_LIKE: 5, TX90L_LIKE: 5, TWO_ARMS: 5}
REFLECTOR = np.array([0.06, -0.04, 0.15])


class YieldingRobot:
    """A robot as built: places off by 0.4 mm and 0.7 mrad, `compliance` (n, 3), rad/(N m), about x, y and z of every link."""

    def __init__(
        self, bodies: tuple[Body, ...], compliance: np.ndarray, rng: np.random.Generator, noise: float = 20e-6
    ) -> None:
        self.bodies, self.compliance, self.rng, self.noise = bodies, compliance, rng, noise
        self.shift = rng.normal(0, 4e-4, (len(bodies), 3))
        self.turn = rng.normal(0, 7e-4, (len(bodies), 3))
        self.reflector = REFLECTOR + rng.normal(0, 1e-3, 3)
        self.station = Rotation.from_rotvec([0.02, -0.03, rng.uniform(-3, 3)]), rng.uniform(-3, 3, 3)

    def point(self, q: np.ndarray) -> np.ndarray:
        """The reflector in the base's frame."""
        bend = np.zeros((len(self.bodies), 3))
        for _ in range(6):
            bend = self.compliance * self._moments(*self._frames(q, bend))
        turns, origins = self._frames(q, bend)
        last = CARRIER[self.bodies]
        return origins[last] + turns[last] @ self.reflector

    def measured(self, count: int, *, noise: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Random poses (count, n) and what the tracker reads (count, 3)."""
        limits = np.array([body.limits for body in self.bodies])
        q = self.rng.uniform(limits[:, 0], limits[:, 1], (count, len(limits)))
        return q, self.seen(q, noise=noise)

    def seen(self, q: np.ndarray, *, noise: bool = True) -> np.ndarray:
        """What the tracker reads (N, 3) at poses (N, n)."""
        turn, place = self.station
        seen = turn.apply([self.point(row) for row in q]) + place
        return seen + self.rng.normal(0, self.noise if noise else 0.0, seen.shape)

    def write(self, path: Path, count: int, *, noise: bool = True) -> Path:
        """A file of random poses."""
        return _write(path, *self.measured(count, noise=noise))

    def write_at(self, path: Path, q: np.ndarray) -> Path:
        """A file of poses (N, n)."""
        return _write(path, q, self.seen(q))

    def _frames(self, q: np.ndarray, bend: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        turns: list[np.ndarray] = []
        origins: list[np.ndarray] = []
        nominal = Rotation.from_euler("xyz", [body.rpy for body in self.bodies]).as_matrix()
        wrong, bent = Rotation.from_rotvec(self.turn).as_matrix(), Rotation.from_rotvec(bend).as_matrix()
        joints = Rotation.from_rotvec(np.outer(q, [0, 0, 1])).as_matrix()
        for i, body in enumerate(self.bodies):
            base = turns[body.parent] if body.parent >= 0 else np.eye(3)
            start = origins[body.parent] if body.parent >= 0 else np.zeros(3)
            origins.append(start + base @ (np.array(body.xyz) + self.shift[i]))
            turns.append(base @ nominal[i] @ wrong[i] @ joints[i] @ bent[i])
        return turns, origins

    def _moments(self, turns: list[np.ndarray], origins: list[np.ndarray]) -> np.ndarray:
        """Gravity moment (n, 3) at every joint, of all that hangs on it, in the axes of its link."""
        result = np.zeros((len(self.bodies), 3))
        for k, body in enumerate(self.bodies):
            centre = origins[k] + turns[k] @ np.array(body.com)
            carrier = k
            while carrier >= 0:
                result[carrier] += turns[carrier].T @ np.cross(centre - origins[carrier], body.mass * G)
                carrier = self.bodies[carrier].parent
        return result


def write_robot(folder: Path, bodies: tuple[Body, ...], *, masses: bool = True) -> Path:
    """The maker's URDF and a robot.yaml without options."""
    links, joints = ['<link name="base"/>'], []
    for i, body in enumerate(bodies):
        inertial = (
            f'<inertial><origin xyz="{_text(body.com)}"/><mass value="{body.mass}"/>'
            '<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
        )
        links.append(f'<link name="l{i + 1}">{inertial if masses else ""}</link>')
        parent = f"l{body.parent + 1}" if body.parent >= 0 else "base"
        joints.append(
            f'<joint name="a{i + 1}" type="revolute"><parent link="{parent}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{_text(body.xyz)}" rpy="{_text(body.rpy)}"/><axis xyz="0 0 1"/>'
            f'<limit lower="{body.limits[0]}" upper="{body.limits[1]}" effort="90" velocity="2"/></joint>'
        )
    (folder / "robot.urdf").write_text(f'<robot name="yielding">{"".join(links + joints)}</robot>', "utf-8")
    point = f"{{frame: l{CARRIER[bodies] + 1}, xyz: [{', '.join(map(str, REFLECTOR))}]}}"
    (folder / "robot.yaml").write_text(f"robot: robot.urdf\npoints: {{smr: {point}}}\n", "utf-8")
    return folder / "robot.yaml"


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(f"{x:.17g}" for x in numbers)


def _write(path: Path, q: np.ndarray, points: np.ndarray) -> Path:
    rows = np.column_stack([np.arange(1, len(q) + 1), q, points])
    header = ",".join(["pose", *(f"q{i + 1}" for i in range(q.shape[1])), "x", "y", "z"])
    np.savetxt(
        path, rows, delimiter=",", header=header, comments="", fmt=["%d"] + ["%.12f"] * (q.shape[1] + 3)
    )
    return path
