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
RIGID = np.zeros((JOINTS, 2))
GRAVITY = np.array([0.0, 0.0, -9.81])
MASSES = (9.0, 7.0, 5.0, 3.0, 2.0, 1.2)
CENTRES = (
    (0.0, 0.02, 0.05),
    (0.2, 0.0, 0.02),
    (0.18, 0.02, 0.0),
    (0.0, 0.02, 0.05),
    (0.01, 0.04, 0.0),
    (0.02, 0.01, 0.04),
)


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


def points(q: np.ndarray, errors: np.ndarray, tool: np.ndarray, compliance: np.ndarray = RIGID) -> np.ndarray:
    """Positions (N, 3), m, of the target in the base frame, with link errors (6, 6): rotation vector, then translation.

    Every joint turns by `compliance` (6, 2), rad/(N m), about its axis and across it, times the moment of the weights of the links behind
    it, in the pose without that.
    """
    result = np.empty((len(q), 3))
    for n, pose in enumerate(q):
        result[n], frames = _placed(pose, errors, tool, np.zeros((JOINTS, 3)))
        if compliance.any():
            weights = [p + r @ c for (r, p), c in zip(frames, CENTRES, strict=True)]
            turns = np.zeros((JOINTS, 3))
            for k, (rotation, position) in enumerate(frames):
                moments = [np.cross(weights[i] - position, MASSES[i] * GRAVITY) for i in range(k, JOINTS)]
                moment = np.sum(moments, axis=0)
                along = (moment @ rotation[:, 2]) * rotation[:, 2]
                turns[k] = compliance[k, 0] * along + compliance[k, 1] * (moment - along)
            result[n], _ = _placed(pose, errors, tool, turns)
    return result


def _placed(
    pose: np.ndarray, errors: np.ndarray, tool: np.ndarray, turns: np.ndarray
) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Target of one pose, and the frames behind the joints, which turn by rotation vectors (6, 3) of the base frame beside their angles."""
    rotation, position, frames = np.eye(3), np.zeros(3), []
    for (xyz, rpy), angle, error, turn in zip(ORIGINS, pose, errors, turns, strict=True):
        position = position + rotation @ np.array(xyz)
        rotation = turned(turn) @ rotation @ roll_pitch_yaw(rpy) @ turned(np.array([0.0, 0.0, angle]))
        frames.append((rotation, position))
        position = position + rotation @ error[3:]
        rotation = rotation @ turned(error[:3])
    return position + rotation @ tool, frames


@dataclass(frozen=True, eq=False)
class SimulatedRobot:
    """A robot of the type in a cell: link errors (6, 6), target (3,), rotation and translation of the tracker, compliance (6, 2)."""

    errors: np.ndarray
    tool: np.ndarray
    place: tuple[np.ndarray, np.ndarray]
    compliance: np.ndarray

    def measured(self, q: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
        """Positions (N, 3), m, that the tracker reads, with noise (1σ of a coordinate, m)."""
        rotation, shift = self.place
        exact = points(q, self.errors, self.tool, self.compliance) @ rotation.T + shift
        return exact + noise * rng.standard_normal((len(q), 3))


@dataclass(frozen=True, eq=False)
class Fleet:
    """Robots of one type: `type_errors` (6, 6) and the `spread` (6, 6) about them, `compliance` (6, 2) and its relative spread."""

    type_errors: np.ndarray
    spread: np.ndarray
    compliance: np.ndarray
    relative: float

    @classmethod
    def drawn(cls, rng: np.random.Generator, spread: float = 0.1, *, soft: bool = False) -> Fleet:
        """A type whose robots differ by `spread` times its own errors, in some numbers by half of it and in others by twice as much."""
        sizes = np.array([1.0e-3] * 3 + [4.0e-4] * 3)
        about = spread * sizes * np.exp(0.4 * rng.standard_normal((JOINTS, 6)))
        errors = sizes * rng.standard_normal((JOINTS, 6))
        compliance = np.array([[2e-5, 1e-5]] * 3 + [[6e-5, 3e-5]] * 3)
        compliance = compliance * np.exp(0.3 * rng.standard_normal((JOINTS, 2)))
        return cls(errors, about, compliance if soft else RIGID, spread)

    def robot(self, rng: np.random.Generator) -> SimulatedRobot:
        """The next robot, in a cell of its own."""
        errors = self.type_errors + self.spread * rng.standard_normal((JOINTS, 6))
        tool = np.array(TOOL) + 3e-3 * rng.standard_normal(3)
        place = turned(0.4 * rng.standard_normal(3)), np.array([2.0, 0.5, 0.3]) + 0.2 * rng.standard_normal(3)
        compliance = self.compliance * (1 + self.relative * rng.standard_normal((JOINTS, 2)))
        return SimulatedRobot(errors, tool, place, compliance)


def random_poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Joint positions (N, 6), rad."""
    return rng.uniform(-2.2, 2.2, (count, JOINTS))


def write_robot(folder: Path) -> Path:
    """Write URDF and robot.yaml of the nominal robot into a folder; returns the latter."""
    folder.mkdir(parents=True, exist_ok=True)
    inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
    parts = ['<robot name="fleet_arm">', '<link name="base_link"/>']
    for k, (xyz, rpy) in enumerate(ORIGINS, 1):
        parent = "base_link" if k == 1 else f"link_{k - 1}"
        centre = " ".join(map(str, CENTRES[k - 1]))
        mass = f'<origin xyz="{centre}"/><mass value="{MASSES[k - 1]}"/>'
        parts.append(
            f'<link name="link_{k}"><inertial>{mass}{inertia}</inertial></link>'
            f'<joint name="joint_{k}" type="revolute"><parent link="{parent}"/><child link="link_{k}"/>'
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
