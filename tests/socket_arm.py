"""Contacts of a ball on the arm of `dh_arm` with the sockets of a fixture that stands anywhere, in NumPy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from dh_arm import TOOL, DHArm, postures, write_robot

FIXTURE = np.array([[0.0, 0.0, 0.0], [0.0, 0.12, 0.0]])
"""Sockets a and b in their fixture, m."""


def held_at(arm: DHArm, place: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Joint positions (6,) with the ball at a place, in a random posture, by Gauss-Newton steps of finite differences."""
    while True:
        q, miss = postures(rng, 1, 0.9)[0], np.full(3, np.inf)
        for _ in range(40):
            ball = arm.points(np.vstack([q, q + 1e-6 * np.eye(6)]))
            miss = place - ball[0]
            if np.linalg.norm(miss) < 1e-10:
                break
            moved = (ball[1:] - ball[0]).T / 1e-6
            q = q + np.clip(moved.T @ np.linalg.solve(moved @ moved.T + 1e-8 * np.eye(3), miss), -0.4, 0.4)
        if np.linalg.norm(miss) < 1e-9 and np.abs(q).max() < 3.0:
            return q


def contacts(
    arm: DHArm,
    rng: np.random.Generator,
    *,
    places: int,
    postures_each: int,
    scatter: float = 3e-5,
    distance: float = 0.12,
    prefix: str = "place",
) -> list[tuple[str, str, np.ndarray]]:
    """Rows of place, socket and joint positions (6,); the ball is off its socket by `scatter`, m, a coordinate."""
    rows = []
    for k in range(places):
        angle = 2.2 * (k / max(places - 1, 1) - 0.5) + 0.1 * rng.normal()
        radius, height = rng.uniform(0.55, 0.95), rng.uniform(0.1, 0.6)
        at = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        for name, place in (("a", at), ("b", at + distance * along)):
            for _ in range(postures_each):
                rows.append((f"{prefix}{k}", name, held_at(arm, place + scatter * rng.normal(size=3), rng)))
    return rows


def write_socket_robot(folder: Path, std: float = 3e-5) -> Path:
    """The nominal arm with a ball and a fixture."""
    robot = write_robot(folder)
    robot.write_text(
        f"robot: robot.urdf\npoints:\n  ball: {{frame: flange, xyz: {list(map(float, TOOL))}}}\ngeometry: {{terms: [kinematic]}}\n"
        f"measurements: {{fixture: {{kind: sockets, sockets: {{a: [0, 0, 0], b: [0, 0.12, 0]}}, std: {std}}}}}\n"
    )
    return robot


def write_contacts(path: Path, rows: Sequence[tuple[str, str, np.ndarray]]) -> Path:
    """A file of contacts."""
    lines = ["fixture,socket," + ",".join(f"q{k}" for k in range(1, 7))]
    lines += [",".join([place, socket, *map(repr, q.tolist())]) for place, socket, q in rows]
    path.write_text("\n".join(lines) + "\n")
    return path
