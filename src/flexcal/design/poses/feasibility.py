"""Feasible candidate poses, their sensitivities, and the working poses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.poses import PosePool
from flexcal.design.poses.candidates import random_candidates
from flexcal.design.poses.geometry_sensitivity import (
    BaseSensitivity,
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
)
from flexcal.design.poses.gravity_preload import preload_joints, preloaded
from flexcal.design.scene import STANDARD, CollisionChecker, MeasuringSetup, visible
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque
from flexcal.progress import Progress, silent

WORKING_POSES = 300
"""Number of random poses over the whole workspace for the tool error of c-optimal design, unless others are given."""


@dataclass(frozen=True, eq=False)
class PoseCandidates:
    """Candidate poses that can be measured with `setup`.

    `base` holds the rows of all poses of the `pool`; `tool_error_weight` (rank, rank), m², turns a covariance into the mean square of the
    tool error over the working poses. `hidden` are the numbers of a given pool's poses that the instrument does not see.
    """

    model: RobotModel
    setup: MeasuringSetup
    pool: PosePool
    base: BaseSensitivity
    tool_error_weight: np.ndarray
    hidden: np.ndarray


def pose_candidates(
    model: RobotModel,
    *,
    rng: np.random.Generator,
    candidates: int | PosePool = 4000,
    least: int = 1,
    setup: MeasuringSetup = STANDARD,
    working: np.ndarray | None = None,
    checker: CollisionChecker | None = None,
    progress: Progress = silent,
) -> PoseCandidates:
    """Random poses, or those of a pool, with gravity surely preloading every backlash; at least `least` of them.

    Random ones keep to the joint limits, collide with nothing (`checker`, by default with 10 mm of margin and a floor at the base) and
    show the target to the instrument. Those of a pool are taken to be free of collision; in those left out the flank is not sure, or
    the instrument does not see the target. The tool error counts over the `working` poses (W, n), by default random ones over the
    whole workspace. A pool's payload counts for it where `setup` has none.

    Raises `FlexcalError` where too few poses pass the checks, and where all of them press a backlash onto one flank.
    """
    checker = CollisionChecker(model) if checker is None else checker
    if isinstance(candidates, PosePool):
        if setup.payload is None:
            setup = replace(setup, payload=candidates.payload)
        seen = visible(checker, candidates.q, setup)
        hidden = candidates.pose[~seen]
        pool = _usable(checker, candidates, seen, least, setup)
    else:
        q = random_candidates(checker, candidates, rng, setup, preload=True, progress=progress)
        pool, hidden = PosePool(q, np.arange(1, len(q) + 1)), np.zeros(0, dtype=int)
    _check_flanks(model, pool.q, setup.payload)
    base = base_sensitivity(pose_sensitivity(model, pool.q, setup))
    if working is None:
        anywhere = replace(setup, acceptance=None)
        working = random_candidates(checker, WORKING_POSES, rng, anywhere)
    return PoseCandidates(model, setup, pool, base, tool_error_weight(base, model, working, setup), hidden)


def tool_error_weight(
    base: BaseSensitivity, model: RobotModel, working: np.ndarray, setup: MeasuringSetup = STANDARD
) -> np.ndarray:
    """W = mean over the `working` poses (W, n) of JᵀJ (rank, rank), m²: tr(W Σ) is the mean square error of the tool position."""
    names, jacobian = geometry_jacobian(model, working, setup)
    assert names == base.identifiability.names
    rows = base.columns(jacobian).reshape(-1, len(base.scale))
    return rows.T @ rows / len(jacobian)


def _usable(
    checker: CollisionChecker, given: PosePool, seen: np.ndarray, least: int, setup: MeasuringSetup
) -> PosePool:
    """Poses of a pool, among those of the mask `seen`, that can be measured; raises `FlexcalError` if fewer than `least`."""
    if not seen.any():
        raise FlexcalError(
            "E-DESIGN-022",
            f"the instrument can measure none of the {len(given)} poses of the pool; check where `stations:` puts it, the "
            "acceptance of the "
            "reflector, and obstacles in its line of sight.",
        )
    shown = given.subset(seen)
    usable = shown.subset(preloaded(checker.model, shown.q, setup.payload))
    if len(usable) < least:
        hidden = f", of which the instrument can measure {len(shown)}" if len(shown) < len(given) else ""
        raise FlexcalError(
            "E-DESIGN-023",
            f"the pool holds {len(given)} poses{hidden}, and the flank of every backlash is certain in {len(usable)} of them; "
            f"{least} cannot be chosen; give more poses or a smaller --count.",
        )
    return usable


def _check_flanks(model: RobotModel, q: np.ndarray, payload: float | None) -> None:
    torque = gravity_torque(model, q, payload)
    for i in preload_joints(model):
        if np.all(torque[:, i] > 0) or np.all(torque[:, i] < 0):
            raise FlexcalError(
                "E-DESIGN-024",
                f"gravity presses {model.joint_names[i]} onto the same flank in all {len(q)} usable poses, so its backlash is "
                "not identifiable beside "
                "its offset; relax the restrictions of the poses, or take it from `geometry: backlash:`.",
            )
