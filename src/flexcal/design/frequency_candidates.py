"""Random poses in which a robot can be excited: room for the motion, nothing touches, and gravity keeps every gap closed."""

from __future__ import annotations

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.design.collision import CollisionChecker
from flexcal.design.gap_crossing import gap_load, share
from flexcal.design.joint_space import joint_ranges
from flexcal.design.multisines import room
from flexcal.design.preload import preloaded
from flexcal.errors import FlexcalError
from flexcal.progress import Progress, silent

_BATCH = 256
_TRIES = 400


def frequency_candidates(
    checker: CollisionChecker,
    plan: MultisinePlan,
    count: int,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> np.ndarray:
    """`count` poses (count, n) rad, uniform over what the joint ranges leave, for the excitation of `plan`; its own poses do not count.

    The robot is checked for collisions at the middle and at both ends of the reference motion. Raises `FlexcalError`, with what each check
    threw out, where too few are found, and names the joint whose range is too small for the motion.
    """
    model = checker.model
    lower, upper = joint_ranges(model)
    need = room(model, plan.reference_amplitude)
    lower, upper = lower + need, upper - need
    for name, low, high, free in zip(model.joint_names, lower, upper, need, strict=True):
        if low >= high:
            raise FlexcalError(
                f"the limits of {name} leave no room for the {np.degrees(free):.3g}° that the motion under the excitation needs on "
                "either side; lower the reference motion."
            )
    swing = np.zeros(model.n)
    swing[list(plan.joints)] = plan.reference_amplitude
    found: list[np.ndarray] = []
    lost = {"gravity preload": 0, "collision": 0}
    for drawn in range(1, _TRIES + 1):
        q = rng.uniform(lower, upper, (_BATCH, model.n))
        held = q[preloaded(model, q, plan.payload)]
        free = [x for x in held if not checker.collides(x + np.outer([0.0, 1.0, -1.0], swing)).any()]
        kept = [x for x in free if share(gap_load(model, x, plan), plan.amplitude) >= 1]
        lost["collision"] += len(held) - len(free)
        lost["gravity preload"] += len(q) - len(held) + len(free) - len(kept)
        found += kept
        progress("candidates", min(1.0, len(found) / count))
        if len(found) >= count:
            return np.array(found[:count])
        if drawn * _BATCH >= 40 * count + 1000 and len(found) < 0.02 * count:
            break
    losses = ", ".join(f"{name} threw out {number}" for name, number in lost.items())
    raise FlexcalError(
        f"of {drawn * _BATCH} random poses of {model.name} only {len(found)} of the wanted {count} can be excited: {losses}; "
        "lower the excitation or the reference motion, or hold a heavier payload."
    )
