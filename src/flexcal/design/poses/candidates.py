"""Random candidate configurations: within limits, free of collision, visible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexcal.design.poses.gravity_preload import preloaded
from flexcal.design.scene import STANDARD, CollisionChecker, MeasuringSetup, visible
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_ranges, point_kinematics, random_configurations
from flexcal.progress import Progress, silent

_TRIES = 100


def random_candidates(
    checker: CollisionChecker,
    count: int,
    rng: np.random.Generator,
    setup: MeasuringSetup = STANDARD,
    *,
    preload: bool = False,
    progress: Progress = silent,
) -> np.ndarray:
    """Uniform random configurations (count, n) over the joint ranges, free of collision and with the target visible.

    With `preload`, only those where gravity surely settles the flank of every backlash. The target too stays above the floor. Only the
    poses are checked, not the ways between them. Raises `FlexcalError`, with what each check threw out, when too few are left.
    """
    model = checker.model
    lower, upper = joint_ranges(model)
    checks = _checks(checker, setup, preload)
    lost = dict.fromkeys(checks, 0)
    accepted: list[np.ndarray] = []
    have = drawn = 0
    while have < count:
        progress("candidates", have / count)
        if drawn >= _TRIES * count + 1000:
            losses = ", ".join(f"{name} threw out {number}" for name, number in lost.items())
            raise FlexcalError(
                "E-DESIGN-021",
                f"of {drawn} random poses of {model.name} only {have} of the wanted {count} are usable: {losses}; "
                "relax the most restrictive one (station, acceptance, obstacles, floor, payload).",
            )
        share = max(have / drawn, 0.02) if drawn else 0.5
        q = random_configurations(model, int(1.1 * (count - have) / share) + 16, rng, lower, upper)
        drawn += len(q)
        for name, check in checks.items():
            passed = check(q)
            lost[name] += int(np.sum(~passed))
            q = q[passed]
        accepted.append(q)
        have += len(q)
    progress("candidates", 1.0)
    return np.concatenate(accepted or [np.zeros((0, model.n))])[:count]


def usable(
    checker: CollisionChecker, q: np.ndarray, setup: MeasuringSetup = STANDARD, *, preload: bool = False
) -> np.ndarray:
    """Mask (samples,) of configurations `q` (samples, n) that pass the checks of `random_candidates`."""
    left = np.arange(len(q))
    for check in _checks(checker, setup, preload).values():
        left = left[check(q[left])]
    return np.isin(np.arange(len(q)), left)


def _checks(
    checker: CollisionChecker, setup: MeasuringSetup, preload: bool
) -> dict[str, Callable[[np.ndarray], np.ndarray]]:
    """Masks of the configurations that pass each check, by its name; the cheapest first."""
    checks: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "floor": lambda q: above_floor(checker, q, setup.point)
    }
    if preload:
        checks["flank preload"] = lambda q: preloaded(checker.model, q, setup.payload)
    checks["collision"] = lambda q: ~checker.collides(q)
    checks["visibility"] = lambda q: visible(checker, q, setup)
    return checks


def above_floor(checker: CollisionChecker, q: np.ndarray, point: str | None = None) -> np.ndarray:
    """Mask (samples,) of configurations `q` (samples, n) with the target above the floor, by the checker's margin."""
    if checker.floor is None:
        return np.ones(len(q), dtype=bool)
    position = point_kinematics(checker.model, q, point=point, jacobians=False).position
    return position[:, 2] > checker.floor + checker.margin
