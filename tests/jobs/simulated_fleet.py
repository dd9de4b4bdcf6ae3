"""A fleet of six-axis robots that share errors of their type, simulated with kinematics of its own, in numpy alone.

Every link is off by six numbers, three rotations and three translations in the frame behind its joint: the type's, and each robot's own.
Each robot stands elsewhere, carries another target, and repeats to 20 µm.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

ORIGINS = (
    ((0.0, 0.0, 0.16), (0.0, 0.0, 0.0)),
    ((0.05, 0.11, 0.02), (-1.45, 0.1, 0.05)),
    ((0.42, 0.0, -0.03), (0.05, 0.03, 0.02)),
    ((0.36, 0.04, 0.02), (0.1, -0.04, 0.03)),
    ((0.02, 0.0, 0.11), (1.5, 0.03, 0.1)),
    ((0.03, 0.1, 0.02), (-1.52, 0.06, 0.04)),
)
TOOL = (0.05, 0.03, 0.12)
JOINTS = len(ORIGINS)


def turned(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle else vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def roll_pitch_yaw(angles: tuple[float, float, float]) -> np.ndarray:
    """Rotation matrix of fixed-axis angles as URDF has them."""
    roll, pitch, yaw = (turned(a * e) for a, e in zip(angles, np.eye(3), strict=True))
    return yaw @ pitch @ roll


def points(q: np.ndarray, errors: np.ndarray, tool: np.ndarray) -> np.ndarray:
    """Positions (N, 3), m, of the target in the base frame, with link errors (6, 6): rotation vector, then translation."""
    result = np.empty((len(q), 3))
    for n, pose in enumerate(q):
        rotation, position = np.eye(3), np.zeros(3)
        for (xyz, rpy), angle, error in zip(ORIGINS, pose, errors, strict=True):
            position = position + rotation @ np.array(xyz)
            rotation = rotation @ roll_pitch_yaw(rpy) @ turned(np.array([0.0, 0.0, angle]))
            position = position + rotation @ error[3:]
            rotation = rotation @ turned(error[:3])
        result[n] = position + rotation @ tool
    return result


@dataclass(frozen=True, eq=False)
class SimulatedRobot:
    """A robot of the type in a cell: link errors (6, 6), target (3,), place of the tracker as rotation and translation."""

    errors: np.ndarray
    tool: np.ndarray
    place: tuple[np.ndarray, np.ndarray]

    def measured(self, q: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
        """Positions (N, 3), m, that the tracker reads, with noise (1σ of a coordinate, m)."""
        rotation, shift = self.place
        return (
            points(q, self.errors, self.tool) @ rotation.T + shift + noise * rng.standard_normal((len(q), 3))
        )


@dataclass(frozen=True, eq=False)
class Fleet:
    """Robots of one type: `type_errors` (6, 6) and the `spread` (6, 6) about them."""

    type_errors: np.ndarray
    spread: np.ndarray

    @classmethod
    def drawn(cls, rng: np.random.Generator, spread: float = 0.1) -> Fleet:
        """A type whose robots differ by `spread` times its own errors, in some numbers by half of it and in others by twice as much."""
        sizes = np.array([1.0e-3] * 3 + [4.0e-4] * 3)
        spread = spread * sizes * np.exp(0.4 * rng.standard_normal((JOINTS, 6)))
        return cls(sizes * rng.standard_normal((JOINTS, 6)), spread)

    def robot(self, rng: np.random.Generator) -> SimulatedRobot:
        """The next robot, in a cell of its own."""
        errors = self.type_errors + self.spread * rng.standard_normal((JOINTS, 6))
        tool = np.array(TOOL) + 3e-3 * rng.standard_normal(3)
        place = turned(0.4 * rng.standard_normal(3)), np.array([2.0, 0.5, 0.3]) + 0.2 * rng.standard_normal(3)
        return SimulatedRobot(errors, tool, place)


def random_poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Joint positions (N, 6), rad."""
    return rng.uniform(-2.2, 2.2, (count, JOINTS))


def write_robot(folder: Path) -> Path:
    """Write URDF and robot.yaml of the nominal robot into a folder; returns the latter."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = ['<robot name="fleet_arm">', '<link name="base_link"/>']
    for k, (xyz, rpy) in enumerate(ORIGINS, 1):
        parent = "base_link" if k == 1 else f"link_{k - 1}"
        parts.append(
            f'<link name="link_{k}"/><joint name="joint_{k}" type="revolute"><parent link="{parent}"/><child link="link_{k}"/>'
            f'<origin xyz="{xyz[0]} {xyz[1]} {xyz[2]}" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/><axis xyz="0 0 1"/>'
            '<limit lower="-3" upper="3" effort="100" velocity="3"/></joint>'
        )
    (folder / "arm.urdf").write_text("\n".join([*parts, "</robot>"]))
    file = folder / "robot.yaml"
    file.write_text(
        f"robot: arm.urdf\npoints:\n  ball: {{frame: link_6, xyz: [{TOOL[0]}, {TOOL[1]}, {TOOL[2]}]}}\n"
        "gravity: [0, 0, -9.81]\ngeometry: {terms: [kinematic]}\n"
    )
    return file


def write_poses(path: Path, q: np.ndarray, measured: np.ndarray) -> Path:
    """Write measured poses as a table."""
    lines = ["pose,q1,q2,q3,q4,q5,q6,x,y,z"]
    lines += [
        ",".join([str(n), *map(repr, map(float, (*a, *p)))])
        for n, (a, p) in enumerate(zip(q, measured, strict=True))
    ]
    path.write_text("\n".join(lines) + "\n")
    return path
