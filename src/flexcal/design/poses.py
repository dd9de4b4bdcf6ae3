"""Which poses to measure: chosen ones for a calibration, random ones for its verification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from flexcal.data import PosePlan
from flexcal.design.candidates import random_candidates
from flexcal.design.collision import CollisionChecker
from flexcal.design.criteria import (
    Criterion,
    DOptimal,
    Observability,
    SpectralCriterion,
    TraceOptimal,
    observability,
)
from flexcal.design.exchange import Selection, exchange
from flexcal.design.pose_sensitivity import (
    BaseSensitivity,
    Tolerances,
    TrackerNoise,
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
)
from flexcal.design.preload import preload_joints
from flexcal.design.visibility import Acceptance
from flexcal.errors import FlexcalError
from flexcal.estimation import Identifiability
from flexcal.model import RobotModel, gravity_torque

CriterionName = Literal["c", "A", "D", "E", "O1", "O2", "O3", "O4", "O5"]
WORKING_POSES = 300
"""Random poses over the whole workspace for which c-optimal design predicts the tool error, unless others are given."""


@dataclass(frozen=True, eq=False)
class PoseDesign:
    """A plan of N poses and why these.

    `candidates` (C, n) are what there was to choose from, `selection` what was chosen by `criterion`; `base` holds the rows of all
    candidates; `tool_weight` (rank, rank), m², turns a covariance into the mean square of the tool error over the working poses;
    `flank` (N, joints with backlash) is the sign of the gravity torque at `flank_joints`.
    """

    plan: PosePlan
    criterion: Criterion
    candidates: np.ndarray
    selection: Selection
    base: BaseSensitivity
    tool_weight: np.ndarray
    flank_joints: tuple[str, ...]
    flank: np.ndarray

    @property
    def identifiability(self) -> Identifiability:
        """Rank of the candidates' kinematic Jacobian, and what absorbed the dropped parameters."""
        return self.base.identifiability

    @property
    def observability(self) -> Observability:
        """O1-O5 of the chosen poses."""
        return observability(self.base.sensitivity, self.selection.chosen)

    @property
    def tool_error(self) -> float:
        """Predicted error of the calibrated tool position, m: root mean square of its length over the working poses.

        From tracker noise alone; what deflection, backlash near its crossing or repeatability add is not in it.
        """
        return tool_error(self.base, self.tool_weight, self.selection.chosen)


def tool_error(base: BaseSensitivity, tool_weight: np.ndarray, chosen: np.ndarray) -> float:
    """Predicted root mean square (m) of the tool error over the working poses behind `tool_weight` after measuring `chosen`."""
    factor = base.sensitivity.factor(chosen)
    return TraceOptimal(tool_weight, "c").trace(factor.T @ factor) ** 0.5


def choose_poses(
    model: RobotModel,
    count: int,
    *,
    rng: np.random.Generator,
    criterion: CriterionName = "c",
    candidates: int = 4000,
    working: np.ndarray | None = None,
    payload: float | None = None,
    point: str | None = None,
    station: str | None = None,
    acceptance: Acceptance | None = None,
    noise: TrackerNoise | None = None,
    tolerances: Tolerances | None = None,
    collision_margin: float = 0.01,
    floor: float | None = 0.0,
) -> PosePlan:
    """The `count` calibration poses that tell most: `design_poses`, of which only the plan is wanted."""
    return design_poses(
        model,
        count,
        rng=rng,
        criterion=criterion,
        candidates=candidates,
        working=working,
        payload=payload,
        point=point,
        station=station,
        acceptance=acceptance,
        noise=noise,
        tolerances=tolerances,
        collision_margin=collision_margin,
        floor=floor,
    ).plan


def design_poses(
    model: RobotModel,
    count: int,
    *,
    rng: np.random.Generator,
    criterion: CriterionName = "c",
    candidates: int = 4000,
    working: np.ndarray | None = None,
    payload: float | None = None,
    point: str | None = None,
    station: str | None = None,
    acceptance: Acceptance | None = None,
    noise: TrackerNoise | None = None,
    tolerances: Tolerances | None = None,
    collision_margin: float = 0.01,
    floor: float | None = 0.0,
) -> PoseDesign:
    """Choose `count` of many random poses by exchange (P1 §5.2).

    Candidates keep to the joint limits, collide with nothing (`collision_margin` m; `floor` m along the base's z, None for none), show
    the target to the instrument, and have every backlash surely preloaded by gravity. Their sensitivities to the geometric errors are
    reduced to what can be identified. Criteria: `c` the tool error predicted over the `working` poses (W, n), by default random
    ones over the whole workspace; `A` the sum of the variances in units of the tolerances; `D` the volume of the confidence
    ellipsoid; `E` σ_min of ΘᵀΘ; `O1`-`O5` the observability indices. `payload` in kg, None for the declared one.

    Raises `FlexcalError` for an unknown criterion, where the poses are fewer than the parameters need, where too few candidates pass the
    checks, and where all of them press a backlash onto one flank.
    """
    checker = CollisionChecker(model, margin=collision_margin, floor=floor)
    q = random_candidates(
        checker,
        candidates,
        rng,
        payload=payload,
        preload=True,
        point=point,
        station=station,
        acceptance=acceptance,
    )
    _check_flanks(model, q, payload)
    full = pose_sensitivity(
        model, q, payload=payload, point=point, station=station, noise=noise, tolerances=tolerances
    )
    base = base_sensitivity(full)
    if 3 * count < base.identifiability.rank:
        raise FlexcalError(
            f"{count} poses cannot determine {base.identifiability.rank} geometric parameters of {model.name}; "
            f"choose at least {-(-base.identifiability.rank // 3)}, better twice as many."
        )
    if working is None:
        working = random_candidates(checker, WORKING_POSES, rng, point=point)
    weight = tool_weight(base, model, working, payload=payload, point=point, station=station)
    wanted = criterion_named(criterion, weight)
    selection = exchange(base.sensitivity, count, wanted)
    chosen = q[selection.chosen]
    masses = None if payload is None else np.full(count, payload)
    loose = list(preload_joints(model))
    return PoseDesign(
        plan=PosePlan(q=chosen, payload=masses, seed=int(rng.integers(2**31))),
        criterion=wanted,
        candidates=q,
        selection=selection,
        base=base,
        tool_weight=weight,
        flank_joints=tuple(model.joint_names[i] for i in loose),
        flank=np.sign(gravity_torque(model, chosen, payload))[:, loose],
    )


def random_poses(
    model: RobotModel,
    count: int,
    rng: np.random.Generator,
    *,
    payload: float | None = None,
    point: str | None = None,
    station: str | None = None,
    acceptance: Acceptance | None = None,
    collision_margin: float = 0.01,
    floor: float | None = 0.0,
) -> PosePlan:
    """Verification poses: uniform over the joint ranges, free of collision, visible, on whatever flank they happen to be.

    Raises `FlexcalError` where too few random poses pass the checks.
    """
    checker = CollisionChecker(model, margin=collision_margin, floor=floor)
    q = random_candidates(checker, count, rng, point=point, station=station, acceptance=acceptance)
    masses = None if payload is None else np.full(count, payload)
    return PosePlan(q=q, payload=masses, seed=int(rng.integers(2**31)))


def tool_weight(
    base: BaseSensitivity,
    model: RobotModel,
    working: np.ndarray,
    *,
    payload: float | None = None,
    point: str | None = None,
    station: str | None = None,
) -> np.ndarray:
    """W = mean over the `working` poses (W, n) of JᵀJ (rank, rank), m²: tr(W Σ) is the mean square error of the tool position."""
    names, jacobian = geometry_jacobian(model, working, payload=payload, point=point, station=station)
    assert names == base.identifiability.names
    rows = base.columns(jacobian).reshape(-1, len(base.scale))
    return rows.T @ rows / len(jacobian)


def criterion_named(name: CriterionName, weight: np.ndarray) -> Criterion:
    """The criterion a user names; `weight` (rank, rank) is for `c`. Raises `FlexcalError` for an unknown name."""
    match name:
        case "c":
            return TraceOptimal(weight, "c")
        case "A":
            return TraceOptimal(np.eye(len(weight)), "A")
        case "D":
            return DOptimal()
        case "E" | "O1" | "O2" | "O3" | "O4" | "O5":
            return SpectralCriterion(name)
    raise FlexcalError(f"there is no criterion '{name}'; choose one of {', '.join(get_args(CriterionName))}.")


def _check_flanks(model: RobotModel, q: np.ndarray, payload: float | None) -> None:
    torque = gravity_torque(model, q, payload)
    for i in preload_joints(model):
        if np.all(torque[:, i] > 0) or np.all(torque[:, i] < 0):
            raise FlexcalError(
                f"gravity presses {model.joint_names[i]} onto the same flank in all {len(q)} usable poses, so its backlash cannot be "
                "told from its offset; loosen what restricts the poses, or take it from `geometry: backlash:`."
            )
