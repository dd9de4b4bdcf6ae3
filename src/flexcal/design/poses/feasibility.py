"""Feasible candidate poses, their sensitivities, and the working poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.fit import FleetPrior, prior_covariance
from flexcal.data.poses import PosePool
from flexcal.design.optimality import TraceBound, TraceOptimal, trace_lower_bound
from flexcal.design.poses.camera_setup import CameraSetup
from flexcal.design.poses.candidates import random_candidates
from flexcal.design.poses.fleet_sensitivity import fleet_jacobian, fleet_sensitivity
from flexcal.design.poses.geometry_sensitivity import (
    BaseSensitivity,
    as_drawn,
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
)
from flexcal.design.poses.gravity_preload import preload_joints, preloaded
from flexcal.design.poses.instrument_sensitivity import instrument_sensitivity
from flexcal.design.poses.instruments import declared_instrument
from flexcal.design.poses.tilt_setup import TiltSetup
from flexcal.design.scene import STANDARD, CollisionChecker, MeasuringSetup, visible
from flexcal.errors import FlexcalError
from flexcal.estimation import Sensitivity
from flexcal.model.kinematics import point_kinematics, rigid_motion_columns
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque
from flexcal.progress import Progress, silent

_PLACED = 3
"""Fewest poses that determine the place of instrument and target."""
WORKING_POSES = 300
"""Number of random poses over the whole workspace for the tool error of c-optimal design, unless others are given."""


@dataclass(frozen=True, eq=False)
class PoseCandidates:
    """Candidate poses that can be measured with `setup`.

    `base` holds the rows of all poses of the `pool`; `tool_motions` (W, 3, rank), m, are those of the tool at the working poses, and
    `tool_error_weight` (rank, rank), m², turns a covariance into the mean square of the tool error over them. `hidden` are the numbers of a
    given pool's poses that the instrument does not see; `unseen`, m, is the root mean square of the tool error due to what no pose tells,
    as the size of the robot at contacts, by the tolerances. `size` (rank + 1,) is the relative change of all lengths in common with the
    parameters and, the last, the standard deviation of what no pose tells of it. With `fleet`, a prior from other robots of the model, the
    parameters are those that a calibration with it estimates.

    The pool may be what is left of `looked_at` candidates (None: of no more than these): its first `sample` poses are then a random sample
    of them, `start` the numbers of a good set, and `bound` with `largest` holds for all of them.
    """

    model: RobotModel
    setup: MeasuringSetup
    pool: PosePool
    base: BaseSensitivity
    tool_motions: np.ndarray
    tool_error_weight: np.ndarray
    hidden: np.ndarray
    size: np.ndarray
    unseen: float = 0.0
    looked_at: int | None = None
    sample: int | None = None
    start: np.ndarray | None = None
    bound: TraceBound | None = None
    largest: float = 0.0
    fleet: FleetPrior | None = None

    @property
    def fewest(self) -> int:
        """Fewest poses that determine what no prior tells: all parameters, or with a `fleet` the place of instrument and target."""
        known = 0 if self.fleet is None else len(self.fleet.names)
        unknown = self.base.identifiability.rank if known == 0 else len(self.base.tolerance) - known
        return -(-unknown // self.base.sensitivity.jacobian.shape[1])

    def least(self, *, uses_prior: bool) -> int:
        """Fewest poses that may be chosen: those that determine what neither a `fleet` nor tolerances tell, which are the prior of a
        calibration on a tracker's points, and of a criterion that `uses_prior`.
        """
        by_tolerances = uses_prior and self.fleet is None and self.setup.measure in (None, "pose")
        return min(_PLACED, self.fewest) if by_tolerances else self.fewest

    def least_errors(self, counts: np.ndarray) -> np.ndarray:
        """Lower bounds (K,) of the tool error, m, of any choice of `counts` (K,) candidates (see `TraceBound`)."""
        if self.bound is not None:
            return self.bound.least(counts, self.largest) ** 0.5
        trace = TraceOptimal(self.tool_error_weight, "c")
        return trace_lower_bound(self.base.sensitivity, trace, counts) ** 0.5


def pose_candidates(
    model: RobotModel,
    *,
    rng: np.random.Generator,
    candidates: int | PosePool = 4000,
    least: int = 1,
    setup: MeasuringSetup = STANDARD,
    working: np.ndarray | None = None,
    checker: CollisionChecker | None = None,
    fleet: FleetPrior | None = None,
    progress: Progress = silent,
) -> PoseCandidates:
    """Random poses, or those of a pool, with gravity surely preloading every backlash; at least `least` of them.

    Random ones keep to the joint limits, collide with nothing (`checker`, by default with 10 mm of margin and a floor at the base of
    a robot that stands) and show the target to the instrument. Those of a pool are taken to be free of collision; in those left out
    the flank is not sure, or the instrument does not see the target. The tool error counts over the `working` poses (W, n), by
    default random ones over the whole workspace. A pool's payload counts for it where `setup` has none. With `fleet` the prior are not the
    tolerances but other robots of the model; what measures is then a tracker of points.

    Raises `FlexcalError` where too few poses pass the checks, and where all of them press a backlash onto one flank.
    """
    checker = CollisionChecker(model) if checker is None else checker
    model = as_drawn(model)
    if isinstance(candidates, PosePool):
        if setup.payload is None:
            setup = replace(setup, payload=candidates.payload)
        seen = visible(checker, candidates.q, setup)
        hidden = candidates.pose[~seen]
        pool = _usable(checker, candidates, seen, least, setup)
    else:
        q = drawn_configurations(checker, candidates, rng, setup, progress=progress)
        if setup.measure is not None:
            _require_reached(checker.model, q, least, setup.measure)
        pool, hidden = PosePool(q, np.arange(1, len(q) + 1)), np.zeros(0, dtype=int)
    _check_flanks(model, pool.q, setup.payload)
    full = full_sensitivity(model, pool.q, setup, fleet)
    base = base_sensitivity(full)
    if fleet is not None:
        base = base.with_prior(prior_covariance(full.parameters, fleet))
    if working is None:
        anywhere = replace(setup, acceptance=None, measure=None)
        working = random_candidates(checker, WORKING_POSES, rng, anywhere)
    rows = (
        tool_motions(base.identifiability.names, model, working, setup)
        if fleet is None
        else fleet_jacobian(model, working, setup, full.parameters.names)
    )
    motions, left = base.columns(rows), unseen_motions(base, rows, full.parameters.prior_std())
    place = point_kinematics(model, working, point=setup.point, jacobians=False).position
    place -= place.mean(axis=0)
    larger = place / (place**2).sum()
    size = np.append(
        np.einsum("wi,wik->k", larger, motions), np.linalg.norm(np.einsum("wi,wip->p", larger, left))
    )
    unseen = float(np.sqrt((left**2).sum() / len(left)))
    weight = tool_error_weight(motions)
    return PoseCandidates(model, setup, pool, base, motions, weight, hidden, size, unseen, fleet=fleet)


def drawn_configurations(
    checker: CollisionChecker,
    count: int,
    rng: np.random.Generator,
    setup: MeasuringSetup,
    *,
    progress: Progress = silent,
) -> np.ndarray:
    """Random configurations, as of `random_candidates` with preload: (count, n), or of so many those (M, n) that reach the instrument that
    is to measure. Raises `FlexcalError` as `random_candidates` does.
    """
    q = random_candidates(checker, count, rng, setup, preload=True, progress=progress)
    if setup.measure is None:
        return q
    model, target = checker.model, checker.model.point(setup.point).name
    instrument = declared_instrument(model, setup.measure)
    q = instrument.reached(model, q, target)
    if instrument.touched:
        q = q[~checker.collides(q)]
        q = q[preloaded(model, q, setup.payload)]
    return q


def full_sensitivity(
    model: RobotModel, q: np.ndarray, setup: MeasuringSetup, fleet: FleetPrior | None = None
) -> Sensitivity:
    """Rows of poses `q` (N, n) in all geometric errors, as the instrument that is to measure reads them; with `fleet` as in
    `fleet_sensitivity`.
    """
    if fleet is not None:
        return fleet_sensitivity(model, q, setup, fleet)
    sensitivity = pose_sensitivity if setup.measure is None else instrument_sensitivity
    return sensitivity(model, q, setup)


def _require_reached(model: RobotModel, q: np.ndarray, least: int, measure: str) -> None:
    """Raise `FlexcalError` where the configurations at the instrument are too few."""
    instrument = declared_instrument(model, measure)
    if len(q) < least and isinstance(instrument, CameraSetup):
        nearest, farthest = instrument.band
        raise FlexcalError(
            "E-DESIGN-054",
            f"only {len(q)} poses show the board to the camera {instrument.name} from {nearest:.2f} to {farthest:.2f} m, and {least} are "
            "to be chosen; correct its `xyz`, `normal`, `axis` or `distance`, or give more --candidates.",
        )
    if len(q) < least and isinstance(instrument, TiltSetup):
        raise FlexcalError(
            "E-DESIGN-057",
            f"only {len(q)} poses keep the inclinometer {instrument.name} within ±{instrument.largest:.3g} "
            f"{'rad' if instrument.config.reads != 'component' else 'of gravity'}, and {least} are to be chosen; correct its `range` or "
            "`rpy`, or give more --candidates.",
        )
    if len(q) < least:
        raise FlexcalError(
            "E-DESIGN-056",
            f"only {len(q)} poses reach {instrument.name} where robot.yaml puts it, and {least} are to be chosen; correct its place, or "
            "give more --candidates.",
        )


def tool_motions(
    names: Sequence[str], model: RobotModel, working: np.ndarray, setup: MeasuringSetup = STANDARD
) -> np.ndarray:
    """Motions (W, 3, p) of the tool at the `working` poses (W, n) with parameters by their names; none with those of an instrument.

    Without what moves all working poses as one body where the instrument does not tell where the base is.
    """
    known, jacobian = geometry_jacobian(model, working, setup)
    if tuple(names) == known:
        return jacobian
    every = np.zeros((len(jacobian), 3, len(names)))
    for k, name in enumerate(names):
        if name in known:
            every[:, :, k] = jacobian[:, :, known.index(name)]
    if setup.measure is None or declared_instrument(model, setup.measure).tells_base:
        return every
    return _wherever_the_base_is(model, working, every, setup.point)


def tool_error_weight(motions: np.ndarray) -> np.ndarray:
    """W = mean over the working poses of JᵀJ (rank, rank), m², with J their `motions` (W, 3, rank): tr(W Σ) is the mean square error of the
    tool position.
    """
    rows = motions.reshape(-1, motions.shape[2])
    return rows.T @ rows / len(motions)


def unseen_motions(base: BaseSensitivity, motions: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
    """Motions (W, 3, p), m, of the tool in the directions that no candidate sees, conditional on the combinations that are seen."""
    regrouping = base.identifiability.regrouping * tolerance
    # the prior, in units of the tolerances, without the span of the seen combinations
    basis = np.linalg.qr(regrouping.T)[0]
    rows = motions * tolerance
    return rows - (rows @ basis) @ basis.T


def _wherever_the_base_is(
    model: RobotModel, working: np.ndarray, rows: np.ndarray, point: str | None
) -> np.ndarray:
    """Motions (W, 3, p) of the tool without what moves all working poses as one body."""
    at = point_kinematics(model, working, point=point, jacobians=False).position
    basis = np.linalg.qr(rigid_motion_columns(at).reshape(-1, 6))[0]
    flat = rows.reshape(len(basis), -1)
    return (flat - basis @ (basis.T @ flat)).reshape(rows.shape)


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
