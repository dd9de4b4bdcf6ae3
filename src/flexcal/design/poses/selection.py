"""Selection of calibration poses, and random verification poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from flexcal.data.plans import PosePlan
from flexcal.data.poses import PosePool
from flexcal.design.optimality import (
    Criterion,
    DOptimal,
    Selection,
    SpectralCriterion,
    TraceOptimal,
    exchange_on_shortlist,
    greedy,
    observability,
)
from flexcal.design.poses.candidates import random_candidates
from flexcal.design.poses.feasibility import PoseCandidates, pose_candidates
from flexcal.design.poses.geometry_sensitivity import BaseSensitivity
from flexcal.design.poses.gravity_preload import preload_joints
from flexcal.design.scene import STANDARD, CollisionChecker, MeasuringSetup
from flexcal.errors import FlexcalError
from flexcal.estimation import Identifiability, distance_probability, principal_variances
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque
from flexcal.progress import Progress, silent
from flexcal.units import MILLIMETRE

CriterionName = Literal["c", "A", "D", "E", "O1", "O2", "O3", "O4", "O5"]


@dataclass(frozen=True, eq=False)
class PoseDesign:
    """A plan of N poses, with candidates, criterion and predicted errors.

    `candidates` are what there was to choose from, `selection` what was chosen by `criterion`; `base` holds the rows of all candidates;
    `tool_motions` (W, 3, rank), m, are those of the tool at the working poses, `tool_error_weight` (rank, rank), m², turns a covariance
    into the mean square of the tool error over them; `fewest` is the least number of poses that determine what no prior tells; `flank`
    (N, joints with backlash) is the sign of the gravity torque at `flank_joints`; `hidden` are the numbers of given poses that the
    instrument does not see; `unseen`, m, is the tool error due to what no pose tells, `size` (rank + 1,) as of the candidates;
    `least_possible`, m, is a lower bound of the tool error for any choice of as many candidates. The candidates may be what is left of
    `looked_at` ones; their first `sample` are then random.
    """

    plan: PosePlan
    criterion: Criterion
    candidates: PosePool
    selection: Selection
    base: BaseSensitivity
    tool_motions: np.ndarray
    tool_error_weight: np.ndarray
    flank_joints: tuple[str, ...]
    flank: np.ndarray
    hidden: np.ndarray
    unseen: float
    size: np.ndarray
    least_possible: float
    looked_at: int
    sample: int
    fewest: int

    @classmethod
    def of(
        cls, candidates: PoseCandidates, criterion: Criterion, selection: Selection, rng: np.random.Generator
    ) -> PoseDesign:
        """Design with this `selection` of the candidates; `rng` draws the plan's seed."""
        chosen = candidates.pool.q[selection.chosen]
        loose = list(preload_joints(candidates.model))
        return cls(
            plan=_plan(chosen, candidates.setup, rng),
            criterion=criterion,
            candidates=candidates.pool,
            selection=selection,
            base=candidates.base,
            tool_motions=candidates.tool_motions,
            tool_error_weight=candidates.tool_error_weight,
            flank_joints=tuple(candidates.model.joint_names[i] for i in loose),
            flank=np.sign(gravity_torque(candidates.model, chosen, candidates.setup.payload))[:, loose],
            hidden=candidates.hidden,
            unseen=candidates.unseen,
            size=candidates.size,
            least_possible=float(candidates.least_errors(np.array([len(chosen)]))[0]),
            looked_at=candidates.looked_at or len(candidates.pool),
            sample=candidates.sample or len(candidates.pool),
            fewest=candidates.fewest,
        )

    def in_order(self, order: np.ndarray) -> PoseDesign:
        """Design with the same poses in this order (N,)."""
        return replace(
            self,
            plan=replace(self.plan, q=self.plan.q[order]),
            selection=replace(self.selection, chosen=self.selection.chosen[order]),
            flank=self.flank[order],
        )

    @property
    def identifiability(self) -> Identifiability:
        """Rank of the candidates' kinematic Jacobian, and the parameters that absorb the dropped ones."""
        return self.base.identifiability

    @property
    def numbers(self) -> np.ndarray:
        """Numbers (N,) of the chosen poses among the candidates, in the order of the plan."""
        return self.candidates.pose[self.selection.chosen]

    @property
    def tool_error(self) -> float:
        """Predicted error of the calibrated tool position, m: root mean square of its length over the working poses.

        From the instrument's noise alone; what deflection, backlash near its crossing or repeatability add is not in it.
        """
        return tool_error(self.base, self.tool_error_weight, self.selection.chosen)

    @property
    def tool_error_p90(self) -> float:
        """90th percentile of that error, m, over working poses and robots."""
        from scipy.optimize import root_scalar

        factor = self.base.sensitivity.factor(self.selection.chosen)
        moved = np.linalg.solve(factor.T, self.tool_motions.swapaxes(1, 2))
        variances = principal_variances(np.matmul(moved.swapaxes(1, 2), moved))
        largest = 4 * float(np.sqrt(variances[:, 0].max()))

        def excess(distance: float) -> float:
            return float(distance_probability(np.full(len(variances), distance), variances).mean()) - 0.9

        return float(root_scalar(excess, bracket=(0.0, largest)).root)

    @property
    def size_std(self) -> float:
        """Relative standard deviation of all lengths of the calibrated robot in common, by the tolerances where no pose tells them."""
        factor = self.base.sensitivity.factor(self.selection.chosen)
        return float(np.hypot(np.linalg.norm(np.linalg.solve(factor.T, self.size[:-1])), self.size[-1]))

    @property
    def criteria(self) -> dict[CriterionName, float]:
        """Values of all criteria for the chosen poses.

        `c` is the tool error (m); `A` the sum of the parameters' variances in units of their tolerances and `D` log det M / p, both with
        the tolerances as prior; `E` (σ_min of ΘᵀΘ) and O1-O5 are of the measurements alone, and absent where these do not determine all
        parameters.
        """
        sensitivity, chosen = self.base.sensitivity, self.selection.chosen
        factor = sensitivity.factor(chosen)
        information = factor.T @ factor
        values: dict[CriterionName, float] = {
            "c": self.tool_error,
            "A": TraceOptimal(np.eye(len(information)), "A").trace(information),
            "D": DOptimal().merit(information),
        }
        if len(chosen) * sensitivity.jacobian.shape[1] < len(information):
            return values
        seen = observability(sensitivity, chosen)
        values |= {
            "E": seen.sigma_min,
            "O1": seen.o1,
            "O2": seen.o2,
            "O3": seen.o3,
            "O4": seen.o4,
            "O5": seen.o5,
        }
        return values


def tool_error(base: BaseSensitivity, tool_error_weight: np.ndarray, chosen: np.ndarray) -> float:
    """Predicted root mean square (m) of the tool error over the working poses behind `tool_error_weight` after measuring `chosen`."""
    factor = base.sensitivity.factor(chosen)
    return TraceOptimal(tool_error_weight, "c").trace(factor.T @ factor) ** 0.5


def select_poses(
    model: RobotModel,
    count: int,
    *,
    rng: np.random.Generator,
    criterion: CriterionName = "c",
    candidates: int | PosePool = 4000,
    setup: MeasuringSetup = STANDARD,
    working: np.ndarray | None = None,
    checker: CollisionChecker | None = None,
    progress: Progress = silent,
) -> PoseDesign:
    """Choose `count` of many random poses, or of a pool of given ones, by exchange (Neubauer et al. 2015, §5.2).

    What counts as a candidate, and `working`, are as in `pose_candidates`. Their sensitivities to the geometric errors are reduced to
    what can be identified. Criteria: `c` the tool error predicted over the working poses; `A` the sum of the variances in units of the
    tolerances; `D` the volume of the confidence ellipsoid; `E` σ_min of ΘᵀΘ; `O1`-`O5` the observability indices.

    Raises `FlexcalError` for an unknown criterion, where the poses are fewer than the parameters need, where too few candidates pass the
    checks, and where all of them press a backlash onto one flank.
    """
    suitable = pose_candidates(
        model,
        rng=rng,
        candidates=candidates,
        least=count,
        setup=setup,
        working=working,
        checker=checker,
        progress=progress,
    )
    return choose_poses(suitable, count, rng=rng, criterion=criterion, progress=progress)


def choose_poses(
    candidates: PoseCandidates,
    count: int,
    *,
    rng: np.random.Generator,
    criterion: CriterionName = "c",
    progress: Progress = silent,
) -> PoseDesign:
    """As `select_poses`, from given candidates; `rng` draws the plan's seed."""
    optimality = criterion_named(criterion, candidates.tool_error_weight)
    least = candidates.least(uses_prior=optimality.uses_prior)
    if count < least:
        what = (
            f"{candidates.base.identifiability.rank} parameters of {candidates.model.name} and the instrument"
            if candidates.fleet is None and least == candidates.fewest
            else "the place of the instrument and the target, which no prior tells"
        )
        raise FlexcalError(
            "E-DESIGN-026",
            f"{count} poses cannot determine {what}; choose at least {least}, better twice as many.",
        )
    if candidates.fleet is not None and not optimality.uses_prior:
        raise FlexcalError(
            "E-DESIGN-058",
            f"the criterion {criterion} judges the measurements alone, without any prior; choose c, A or D with --prior.",
        )
    start = candidates.start if candidates.start is not None and len(candidates.start) == count else None
    selection = exchange_on_shortlist(
        candidates.base.sensitivity, count, optimality, start=start, progress=progress
    )
    return PoseDesign.of(candidates, optimality, selection, rng)


def fewest_poses(candidates: PoseCandidates, most: int, desired_error: float) -> int:
    """Least number of candidates, chosen one by one, with a predicted tool error of at most `desired_error` (m); raises `FlexcalError` if
    `most` do not suffice.
    """
    weight, sensitivity = candidates.tool_error_weight, candidates.base.sensitivity
    order = greedy(sensitivity, most, TraceOptimal(weight, "c")).chosen
    for count in range(candidates.least(uses_prior=True), most + 1):
        if tool_error(candidates.base, weight, order[:count]) <= desired_error:
            return count
    reached = tool_error(candidates.base, weight, order)
    raise FlexcalError(
        "E-DESIGN-027",
        f"{most} poses predict a tool error of {reached / MILLIMETRE:.4f} mm from the instrument's noise alone, not "
        f"{desired_error / MILLIMETRE:.4f} mm; "
        "allow more poses, or a larger error.",
    )


def random_poses(
    model: RobotModel,
    count: int,
    rng: np.random.Generator,
    setup: MeasuringSetup = STANDARD,
    *,
    checker: CollisionChecker | None = None,
) -> PosePlan:
    """Random poses for verification: uniform over the joint ranges, free of collision and visible, on either flank of the backlash.

    Parameters
    ----------
    model : RobotModel
        The robot.
    count : int
        Number of poses.
    rng : numpy.random.Generator
        Source of the random numbers.
    setup : MeasuringSetup
        Target point, instrument and payload.
    checker : CollisionChecker, optional
        Collision checker of this robot, where there is one already.

    Returns
    -------
    PosePlan
        The poses, in the order in which they were drawn.

    Raises
    ------
    FlexcalError
        Where too few random poses pass the checks.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import RobotModel, random_poses
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> random_poses(model, 5, np.random.default_rng(0)).q.shape
    (5, 6)
    """
    checker = CollisionChecker(model) if checker is None else checker
    return _plan(random_candidates(checker, count, rng, setup), setup, rng)


def criterion_named(name: CriterionName, weight: np.ndarray) -> Criterion:
    """Criterion by name; `weight` (rank, rank) is for `c`. Raises `FlexcalError` for an unknown name."""
    match name:
        case "c":
            return TraceOptimal(weight, "c")
        case "A":
            return TraceOptimal(np.eye(len(weight)), "A")
        case "D":
            return DOptimal()
        case "E" | "O1" | "O2" | "O3" | "O4" | "O5":
            return SpectralCriterion(name)
    raise FlexcalError(
        "E-DESIGN-028", f"there is no criterion '{name}'; choose one of {', '.join(get_args(CriterionName))}."
    )


def _plan(q: np.ndarray, setup: MeasuringSetup, rng: np.random.Generator) -> PosePlan:
    masses = None if setup.payload is None else np.full(len(q), setup.payload)
    return PosePlan(q=q, payload=masses, seed=int(rng.integers(2**31)))
