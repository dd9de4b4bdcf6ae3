"""Working volume: configurations with the target at points of a box, or at given points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.design.poses.candidates import above_floor
from flexcal.design.scene import CollisionChecker
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_ranges, random_configurations, reach_points

TRIES = 12
"""Number of starts from which a point is tried."""
BOX_POINTS = 300
"""Number of points drawn in a box."""


@dataclass(frozen=True, eq=False)
class WorkingVolume:
    """Configurations `q` (W, n) with the target at `points` (W, 3), m, base frame.

    `reached` is the share of the points asked for that the robot reaches; `box` its corners (2, 3), None where points were given.
    """

    q: np.ndarray
    points: np.ndarray
    reached: float = 1.0
    box: np.ndarray | None = None


def working_box(
    checker: CollisionChecker,
    lower: np.ndarray,
    upper: np.ndarray,
    rng: np.random.Generator,
    *,
    point: str | None = None,
) -> WorkingVolume:
    """Reachable ones of 300 random points between the corners `lower` and `upper` (3,), m, base frame, in random orientations.

    Raises `FlexcalError` where a lower corner is not below the upper one, and where the robot reaches none of them.
    """
    if not np.all(lower < upper):
        raise FlexcalError(
            "E-DESIGN-032",
            f"the working volume from {_told(lower)} to {_told(upper)} is no box; give every smallest coordinate before the largest.",
        )
    targets = rng.uniform(lower, upper, (BOX_POINTS, 3))
    q, reached = _configurations(checker, targets, rng, point)
    if not reached.any():
        raise FlexcalError(
            "E-DESIGN-033",
            f"{checker.model.name} reaches no point of the working volume from {_told(lower)} to {_told(upper)} m without touching "
            f"something, though it reaches {checker.model.reach:.3g} m; give it in m in the robot's base frame.",
        )
    return WorkingVolume(q[reached], targets[reached], float(reached.mean()), np.stack([lower, upper]))


def working_points(
    checker: CollisionChecker, points: np.ndarray, rng: np.random.Generator, *, point: str | None = None
) -> WorkingVolume:
    """Given `points` (W, 3), m, base frame, each in a random orientation. Raises `FlexcalError` for one out of reach."""
    q, reached = _configurations(checker, points, rng, point)
    if not reached.all():
        first = int(np.argmin(reached))
        raise FlexcalError(
            "E-DESIGN-034",
            f"{checker.model.name} does not reach working point {first + 1} at {_told(points[first])} m without touching something "
            f"({int(np.sum(~reached))} of {len(points)} points are like that); give them in m in the robot's base frame.",
        )
    return WorkingVolume(q, points)


def _configurations(
    checker: CollisionChecker, targets: np.ndarray, rng: np.random.Generator, point: str | None
) -> tuple[np.ndarray, np.ndarray]:
    """Configurations (W, n) for the points (W, 3), and a mask (W,) of those found."""
    model = checker.model
    lower, upper = joint_ranges(model)
    q = np.zeros((len(targets), model.n))
    solved = np.zeros(len(targets), dtype=bool)
    for _ in range(TRIES):
        left = np.flatnonzero(~solved)
        if not len(left):
            break
        tried, reached = reach_points(
            model,
            targets[left],
            random_configurations(model, len(left), rng, lower, upper),
            lower,
            upper,
            point=point,
        )
        reached &= above_floor(checker, tried, point)
        reached[reached] = ~checker.collides(tried[reached])
        q[left[reached]], solved[left[reached]] = tried[reached], True
    return q, solved


def _told(position: np.ndarray) -> str:
    return ", ".join(f"{value:g}" for value in position)
