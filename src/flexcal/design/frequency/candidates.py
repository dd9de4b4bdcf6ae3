"""Random candidate poses of frequency experiments: room for the motion, no collision, gaps closed by gravity."""

from __future__ import annotations

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency.backlash_limit import amplitude_share, backlash_load
from flexcal.design.frequency.multisines import excitation_margin
from flexcal.design.poses import preloaded
from flexcal.design.scene import CollisionChecker
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_ranges
from flexcal.progress import Progress, silent

_BATCH = 256
_TRIES = 400


class FrequencyPoseCandidates:
    """Feasible poses for exciting a robot by `plan`: within its limits with room for the motion, without contact, every gap closed.

    The robot is checked for collisions at the middle and at both ends of the reference motion. Raises `FlexcalError` that names the joint
    whose range is too small for the motion.
    """

    def __init__(self, checker: CollisionChecker, plan: MultisinePlan) -> None:
        self.checker, self.plan, self.model = checker, plan, checker.model
        lower, upper = joint_ranges(self.model)
        need = excitation_margin(self.model, plan.reference_amplitude)
        self.lower, self.upper = lower + need, upper - need
        for name, low, high, free in zip(self.model.joint_names, self.lower, self.upper, need, strict=True):
            if low >= high:
                raise FlexcalError(
                    "E-DESIGN-002",
                    f"the limits of {name} leave less room than the {np.degrees(free):.3g}° that the motion under the excitation needs "
                    "on either side; lower the reference motion.",
                )

    def random(self, count: int, rng: np.random.Generator, progress: Progress = silent) -> np.ndarray:
        """Uniform random poses (count, n), rad; raises `FlexcalError`, with the number rejected by each check, if too few are found."""
        accepted: list[np.ndarray] = []
        lost = {"gravity preload": 0, "collision": 0}
        drawn = 0
        for _ in range(_TRIES):
            q = rng.uniform(self.lower, self.upper, (_BATCH, self.model.n))
            drawn += _BATCH
            accepted += list(self.kept(q, lost))
            progress("candidates", min(1.0, len(accepted) / count))
            if len(accepted) >= count:
                return np.array(accepted[:count])
            if drawn >= 40 * count + 1000 and len(accepted) < 0.02 * count:
                break
        losses = ", ".join(f"{name} threw out {number}" for name, number in lost.items())
        raise FlexcalError(
            "E-DESIGN-003",
            f"of {drawn} random poses of {self.model.name} only {len(accepted)} of the wanted {count} can be excited: {losses}; "
            "lower the excitation or the reference motion, or hold a heavier payload.",
        )

    def near(self, q: np.ndarray, count: int, std: float, rng: np.random.Generator) -> np.ndarray:
        """Feasible ones of `count` poses about each of `q` (P, n), with the standard deviation `std` (rad) in every joint."""
        moved = np.repeat(q, count, axis=0) + std * rng.standard_normal((count * len(q), self.model.n))
        return self.kept(np.clip(moved, self.lower, self.upper))

    def kept(self, q: np.ndarray, lost: dict[str, int] | None = None) -> np.ndarray:
        """Poses of `q` (samples, n) that pass all checks; the numbers rejected are added to `lost`."""
        lost = {"gravity preload": 0, "collision": 0} if lost is None else lost
        swing = np.isin(np.arange(self.model.n), self.plan.joints) * self.plan.reference_amplitude
        ends = np.outer([0.0, 1.0, -1.0], swing)
        preloaded_poses = q[preloaded(self.model, q, self.plan.payload)]
        free = [x for x in preloaded_poses if not self.checker.collides(x + ends).any()]
        closed = [
            x
            for x in free
            if amplitude_share(backlash_load(self.model, x, self.plan), self.plan.amplitude) >= 1
        ]
        lost["collision"] += len(preloaded_poses) - len(free)
        lost["gravity preload"] += len(q) - len(preloaded_poses) + len(free) - len(closed)
        return np.array(closed).reshape(-1, self.model.n)
