"""Order of poses with short joint moves, free of collision where possible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.design.poses.candidates import above_floor
from flexcal.design.poses.travelling_salesman import shortest_path
from flexcal.design.scene import CollisionChecker
from flexcal.model.kinematics import link_frames

UNLIMITED = 1.0
"""Speed, rad/s or m/s, of a joint without a limit in the URDF."""
ROUNDS = 50
"""Largest number of paths tried, each without the moves found to collide."""
_EVEN = 64
"""Number of configurations of a move between which its bodies' travel is measured."""


@dataclass(frozen=True, eq=False)
class MeasurementOrder:
    """`order` (N,) of the poses, least `seconds` (N - 1,) of the moves, and which are `blocked` (N - 1,) and need a way round."""

    order: np.ndarray
    seconds: np.ndarray
    blocked: np.ndarray


def measurement_order(
    checker: CollisionChecker, q: np.ndarray, *, point: str | None = None
) -> MeasurementOrder:
    """Short path through the poses `q` (N, n) with any start: first the fewest blocked moves, then the shortest time.

    A move is as long as its slowest joint at full speed needs. Only the moves of a way are checked for collision; those that touch
    something are made dear, and the way is improved again, until it has no new ones.
    """
    seconds = move_seconds(checker, q)
    dear = 1 + float(seconds.sum())
    known: dict[tuple[int, int], bool] = {}
    cost = seconds.copy()
    order = shortest_path(cost)
    for _ in range(ROUNDS):
        new = [move for move in _moves(order) if move not in known]
        for first, second in new:
            known[first, second] = move_collides(checker, q[first], q[second], point=point)
            if known[first, second]:
                cost[[first, second], [second, first]] += dear
        if not any(known[move] for move in new):
            break
        order = shortest_path(cost, start=order)
    ways = _moves(order)
    touching = [
        known[a, b] if (a, b) in known else move_collides(checker, q[a], q[b], point=point) for a, b in ways
    ]
    return MeasurementOrder(order, seconds[order[:-1], order[1:]], np.array(touching, dtype=bool))


def move_seconds(checker: CollisionChecker, q: np.ndarray) -> np.ndarray:
    """Least time (N, N), s, between the poses `q` (N, n), all joints moving at once, none faster than its limit."""
    speed = np.array([joint.velocity for joint in checker.model.motor_joints])
    speed = np.where(np.isfinite(speed) & (speed > 0), speed, UNLIMITED)
    return np.max(np.abs(q[:, None] - q[None]) / speed, axis=2)


def move_collides(
    checker: CollisionChecker, start: np.ndarray, end: np.ndarray, *, point: str | None = None
) -> bool:
    """Whether the straight joint move from `start` (n,) to `end` (n,) collides, or takes the target through the floor.

    Checked so densely that no joint's origin and no target travels farther than twice the checker's margin in between.
    """
    path = start + np.linspace(0, 1, _EVEN)[:, None] * (end - start)
    _, origin = link_frames(checker.model, path)
    travel = np.linalg.norm(np.diff(origin, axis=0), axis=2).sum(axis=0).max()
    count = int(np.ceil((travel + 0.1 * np.abs(end - start).sum()) / (2 * max(checker.margin, 1e-3)))) + 2
    path = start + np.linspace(0, 1, count)[:, None] * (end - start)
    return bool(not above_floor(checker, path, point).all() or checker.collides(path).any())


def _moves(order: np.ndarray) -> list[tuple[int, int]]:
    return [(min(a, b), max(a, b)) for a, b in zip(order[:-1].tolist(), order[1:].tolist(), strict=True)]
