"""A gantry of three slides with a wrist of two joints, and a tracker, with nothing of flexcal in them.

Its slides are not quite square, and their screws have other leads than said, as most have.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from palletiser import turn

LIMITS = np.array([[0.0, 3.0], [-1.0, 1.0], [-0.6, 0.3], [-3.0, 3.0], [-1.6, 1.6]])
NAMES = ("x", "y", "z", "c", "a")
AXES = np.eye(3)[[0, 1, 2, 2, 1]]
PLACES = np.array([[0, 0, 2.0], [0, 0, 0], [0, 0, 0], [0, 0, -0.2], [0, 0.05, -0.1]])
REFLECTOR = np.array([0.08, 0.02, -0.15])
TRACKER = 0.02e-3


@dataclass(frozen=True)
class Gantry:
    """One as built: zeros (m, rad), lean of every axis (rad), relative errors of the leads, and of the places of the wrist's joints (m)."""

    zero: np.ndarray
    lean: np.ndarray
    lead: np.ndarray
    place: np.ndarray

    @classmethod
    def nominal(cls) -> Gantry:
        """As drawn."""
        return cls(np.zeros(5), np.zeros((5, 3)), np.zeros(3), np.zeros((2, 3)))

    @classmethod
    def drawn(cls, seed: int) -> Gantry:
        """As built."""
        rng = np.random.default_rng([seed, 5])
        zero = np.array([1e-3, 1e-3, 1e-3, 3e-3, 3e-3]) * rng.normal(size=5)
        return cls(
            zero, 1e-3 * rng.normal(size=(5, 3)), 1.5e-4 * rng.normal(size=3), 5e-4 * rng.normal(size=(2, 3))
        )

    def reflector(self, q: np.ndarray) -> np.ndarray:
        """Where the reflector is (N, 3), m, in the base frame with the axes at `q` (N, 5)."""
        at = q + self.zero
        at[:, :3] += self.lead * q[:, :3]
        leaning = [_lean(vector) for vector in self.lean]
        slides = np.stack([turned @ axis for turned, axis in zip(leaning, AXES, strict=True)])
        wrist = leaning[3] @ turn(2, at[:, 3])
        head = wrist @ leaning[4] @ turn(1, at[:, 4])
        carried = PLACES[0] + at[:, :3] @ slides[:3] + PLACES[3] + self.place[0]
        return carried + wrist @ (PLACES[4] + self.place[1]) + head @ REFLECTOR

    def measured(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """What a tracker in the hall reads (N, 3), m."""
        return (self.reflector(q) + TRACKER * rng.normal(size=(len(q), 3))) @ turn(2, 0.4)[0].T + [
            1.0,
            2.0,
            0.5,
        ]


def _lean(vector: np.ndarray) -> np.ndarray:
    x, y, z = vector
    return (turn(0, x) @ turn(1, y) @ turn(2, z))[0]


def poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Positions (N, 5) within the limits."""
    low, high = 0.95 * LIMITS.T
    return rng.uniform(low, high, (count, 5))


def write_robot(folder: Path) -> Path:
    """robot.yaml of the gantry."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = ['<link name="base"/>']
    for k, name in enumerate(NAMES):
        parent = f"link_{NAMES[k - 1]}" if k else "base"
        xyz, axis = (" ".join(map(str, row.tolist())) for row in (PLACES[k], AXES[k]))
        parts.append(
            f'<link name="link_{name}"/><joint name="{name}" type="{"prismatic" if k < 3 else "revolute"}"><parent link="{parent}"/>'
            f'<child link="link_{name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/><limit lower="{LIMITS[k, 0]}" upper="{LIMITS[k, 1]}" '
            'effort="1000" velocity="2"/></joint>'
        )
    (folder / "gantry.urdf").write_text(f'<robot name="gantry">{"".join(parts)}</robot>')
    (folder / "robot.yaml").write_text(
        f"robot: gantry.urdf\npoints: {{smr: {{frame: link_a, xyz: {REFLECTOR.tolist()}}}}}\n"
    )
    return folder / "robot.yaml"
