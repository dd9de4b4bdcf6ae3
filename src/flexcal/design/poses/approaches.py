"""Sides from which the joints come to the poses of a plan, so that hysteresis of gears is told from joint zeros and gravity."""

from __future__ import annotations

import numpy as np

from flexcal.data.plans import OVERTRAVEL, PosePlan
from flexcal.design.poses.ordering import move_collides
from flexcal.design.scene import CollisionChecker
from flexcal.model.kinematics import joint_limits
from flexcal.model.statics import gravity_torque

_DRAWN = 200
"""Number of random plans of sides of which the least correlated is taken."""
_TRIES = 20
"""Number of other sides tried for a pose whose way would collide."""


def crossed_approaches(
    checker: CollisionChecker, plan: PosePlan, rng: np.random.Generator, *, point: str | None = None
) -> np.ndarray:
    """Signs (N, n) of the last motion of every joint that turns: half of the poses from each side, and these crossed like factors of an
    experiment.

    Of random balanced plans the one whose largest correlation is the least, between the sides of any two joints, or between the side of a
    joint and its position or gravity torque, which its other errors go with. A joint comes from the side that its limits leave for the
    overtravel. A pose whose way from there would collide gets other sides, or none (0) where all that were tried collide.
    """
    model, q = checker.model, plan.q
    turning = np.array([joint.kind == "revolute" for joint in model.motor_joints])
    lower, upper = joint_limits(model)
    above, below = q + OVERTRAVEL > upper, q - OVERTRAVEL < lower
    free, forced = turning & ~(above & below), above.astype(int) - below
    others = np.stack([q, gravity_torque(model, q, plan.payload)[:, list(model.motors)]], axis=2)
    others = others - others.mean(axis=0)
    others /= np.maximum(np.linalg.norm(others, axis=0), 1e-9)
    balanced = np.where(np.arange(len(q)) % 2, 1, -1)

    def drawn() -> np.ndarray:
        sides = np.column_stack([rng.permutation(balanced * rng.choice([-1, 1])) for _ in turning])
        return np.where(forced == 0, sides, forced) * free

    def correlation(sides: np.ndarray) -> float:
        centred = sides - sides.mean(axis=0)
        unit = centred / np.maximum(np.linalg.norm(centred, axis=0), 1e-9)
        among = np.abs(unit.T @ unit - np.eye(len(turning)) * (unit**2).sum(axis=0))
        return float(max(among.max(), np.abs(np.einsum("nj,njk->jk", unit, others)).max()))

    best = min((drawn() for _ in range(_DRAWN)), key=correlation)
    for row, sides in enumerate(best):
        tried = 0
        while sides.any() and move_collides(checker, q[row] - OVERTRAVEL * sides, q[row], point=point):
            tried += 1
            sides[:] = drawn()[row] if tried < _TRIES else 0
    return best


def blocked_ways(checker: CollisionChecker, plan: PosePlan, *, point: str | None = None) -> np.ndarray:
    """Which of the straight joint moves (N - 1,) from a pose to the overtravel of the next one collide."""
    ways = zip(plan.q[:-1], plan.via[1:], strict=True)
    return np.array([move_collides(checker, start, end, point=point) for start, end in ways], dtype=bool)
