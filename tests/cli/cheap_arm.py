"""A low-cost arm of five hobby servos that shares nothing with flexcal: plain NumPy, its own URDF, printed links, play in every joint.

Its user set the joint zeros by eye, one of them far off. The play of a joint is taken up to where gravity pushes, unless friction holds the
joint where the last motion left it. Servos count 4096 ticks a turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

AXES = ("z", "y", "y", "y", "x")
OFFSETS = ((0.0, 0.0, 0.055), (0.03, 0.0, 0.06), (0.028, 0.0, 0.113), (0.135, 0.0, 0.005), (0.061, 0.0, 0.0))
"""Each joint's origin in the link before it, m, joints at zero."""
TIP = (0.07, 0.012, -0.02)
"""The marker in the last link, m."""
MASSES = (0.12, 0.14, 0.13, 0.09, 0.15)
CENTRES = ((0.0, 0.0, 0.03), (0.01, 0.0, 0.06), (0.07, 0.0, 0.0), (0.03, 0.0, 0.0), (0.04, 0.0, 0.0))
LIMITS = ((-1.7, 1.7), (-1.6, 1.6), (-1.6, 1.6), (-1.6, 1.6), (-2.6, 2.6))
TICK = 2 * np.pi / 4096
DEGREE = np.pi / 180


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about a unit vector."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def small(vector: np.ndarray) -> np.ndarray:
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle == 0 else about(vector / angle, angle)


def quaternion(r: np.ndarray) -> np.ndarray:
    w = np.sqrt(max(0.0, 1 + np.trace(r))) / 2
    if w > 0.1:
        return np.array(
            [w, (r[2, 1] - r[1, 2]) / (4 * w), (r[0, 2] - r[2, 0]) / (4 * w), (r[1, 0] - r[0, 1]) / (4 * w)]
        )
    _, vectors = np.linalg.eigh(r + r.T)
    axis = vectors[:, -1]
    sine = axis @ np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2
    angle = np.arctan2(sine, (np.trace(r) - 1) / 2)
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])


@dataclass
class CheapArm:
    """An arm whose zeros are off by `zero` degrees (1σ) and one joint by `worst`, with `play` degrees of play in all, and printed links."""

    seed: int = 0
    zero: float = 3.0
    worst: float = 17.0
    play: tuple[float, float] = (1.0, 2.0)
    length: float = 0.7e-3
    tilt: float = 0.5
    noise: float = 0.5e-3
    friction: float = 0.06

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        self.axis = np.array([np.eye(3)["xyz".index(a)] for a in AXES])
        self.zeros = self.zero * DEGREE * rng.normal(size=5)
        self.zeros[rng.integers(1, 4)] = self.worst * DEGREE * rng.choice([-1, 1])
        self.gap = DEGREE * rng.uniform(*self.play, size=5) if self.play[1] else np.zeros(5)
        self.offsets = np.array(OFFSETS) + self.length * rng.normal(size=(5, 3))
        self.tilts = [small(self.tilt * DEGREE * rng.normal(size=3)) for _ in range(5)]
        self.tip = np.array(TIP) + np.array([0.003, -0.002, 0.002]) * rng.normal(size=3)
        self.camera = small(rng.normal(size=3)), np.array([0.4, -0.3, 0.5]) + 0.1 * rng.normal(size=3)
        self.board = small(0.3 * rng.normal(size=3))

    def links(self, angles: np.ndarray, *, true: bool) -> list[tuple[np.ndarray, np.ndarray]]:
        """Rotation and origin of every link in the base."""
        r, p, found = np.eye(3), np.zeros(3), []
        for i, angle in enumerate(angles):
            p = p + r @ (self.offsets[i] if true else np.array(OFFSETS[i]))
            r = r @ (self.tilts[i] if true else np.eye(3)) @ about(self.axis[i], angle)
            found.append((r, p))
        return found

    def torques(self, angles: np.ndarray) -> np.ndarray:
        """Torque (5,) of gravity on every joint, N m."""
        links = self.links(angles, true=True)
        torque = np.zeros(5)
        for i, (r, p) in enumerate(links):
            axis = r @ self.axis[i]
            for mass, centre, (rj, pj) in list(zip(MASSES, CENTRES, links, strict=True))[i:]:
                torque[i] += axis @ np.cross(pj + rj @ np.array(centre) - p, [0, 0, -9.81 * mass])
        return torque

    def play_at(self, angles: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Where in its play every joint stands, rad: pushed by gravity, or as the last motion left it."""
        torque = self.torques(angles)
        pushed = np.where(np.abs(torque) > self.friction, np.sign(torque), rng.choice([-1.0, 1.0], 5))
        return 0.5 * self.gap * pushed

    def postures(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Commanded joint positions (count, 5) in whole ticks, with the marker above the table."""
        low, high = np.array(LIMITS).T
        rows = []
        while len(rows) < count:
            q = 0.75 * rng.uniform(low, high)
            r, p = self.links(q, true=False)[-1]
            if (p + r @ np.array(TIP))[2] > 0.02:
                rows.append(TICK * np.round(q / TICK))
        return np.array(rows)

    def marker(self, q: np.ndarray, rng: np.random.Generator | None) -> tuple[np.ndarray, np.ndarray]:
        """Place (N, 3) and rotation (N, 3, 3) of the marker in the base; without play where there is no `rng`."""
        places, turns = [], []
        for row in np.atleast_2d(q):
            angles = row + self.zeros
            r, p = self.links(angles + (0 if rng is None else self.play_at(angles, rng)), true=True)[-1]
            places.append(p + r @ self.tip)
            turns.append(r @ self.board)
        return np.array(places), np.array(turns)

    def write(self, folder: Path, more: str = "") -> Path:
        """robot.urdf and robot.yaml."""
        folder.mkdir(parents=True, exist_ok=True)
        text = ['<robot name="cheap"><link name="base"/>']
        for i, (axis, xyz, mass, centre, (low, high)) in enumerate(
            zip(AXES, OFFSETS, MASSES, CENTRES, LIMITS, strict=True)
        ):
            name = ("pan", "lift", "elbow", "flex", "roll")[i]
            parent = "base" if i == 0 else f"{('pan', 'lift', 'elbow', 'flex', 'roll')[i - 1]}_link"
            direction = " ".join("1" if axis == a else "0" for a in "xyz")
            text.append(
                f'<link name="{name}_link"><inertial><origin xyz="{" ".join(map(str, centre))}"/><mass value="{mass}"/>'
                '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
                f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{name}_link"/>'
                f'<origin xyz="{" ".join(map(str, xyz))}"/><axis xyz="{direction}"/>'
                f'<limit lower="{low}" upper="{high}" effort="2" velocity="3"/></joint>'
            )
        (folder / "cheap.urdf").write_text("".join(text) + "</robot>")
        robot = folder / "robot.yaml"
        robot.write_text(
            f"robot: cheap.urdf\npoints:\n  marker: {{frame: roll_link, xyz: {list(TIP)}}}\n{more}"
        )
        return robot

    def write_poses(
        self, path: Path, q: np.ndarray, rng: np.random.Generator, *, board: bool = False, sigma: bool = True
    ) -> Path:
        """What a camera in the cell measures of the marker; with `board` its orientation too, to 0.3 degrees."""
        places, turns = self.marker(q, rng)
        r, p = self.camera
        header = [*(f"q{i + 1}" for i in range(5)), "x", "y", "z"]
        header += ["sigma"] * sigma + ["qw", "qx", "qy", "qz"] * board
        lines = [",".join(["pose", *header])]
        for k, (row, place, turned) in enumerate(zip(q, places, turns, strict=True)):
            seen = r @ place + p + self.noise * rng.normal(size=3)
            numbers = [*row, *seen] + [self.noise] * sigma
            if board:
                numbers += list(quaternion(r @ turned @ small(0.3 * DEGREE * rng.normal(size=3))))
            lines.append(",".join([str(k + 1), *(repr(float(v)) for v in numbers)]))
        path.write_text("\n".join(lines) + "\n")
        return path
