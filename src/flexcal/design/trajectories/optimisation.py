"""Optimal exciting trajectories within a robot's limits (Swevers 1997)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.plans import FourierPaths, SplinePaths, TrajectoryPlan
from flexcal.design.scene import Clearance, CollisionChecker
from flexcal.design.trajectories.criterion import (
    ExcitationCriterion,
    TrajectoryCriterion,
    declared_unknowns,
    excitation_criterion,
)
from flexcal.design.trajectories.excitation_problem import NEAR, ExcitationProblem
from flexcal.design.trajectories.feasible_start import (
    FINER,
    feasible_postures,
    feasible_start_motion,
    require_holding_torque,
)
from flexcal.design.trajectories.interior_point import minimise
from flexcal.design.trajectories.limit_usage import MotionLimits
from flexcal.design.trajectories.motion_space import Kind, MotionSpace
from flexcal.design.trajectories.regressor_columns import BaseRegressor
from flexcal.design.trajectories.required_limits import require_stated_limits
from flexcal.design.trajectories.sequences import Stage
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

SETTLE_PERIODS = 1
RATE_HZ = 1000.0
"""Sampling rate of the log if robot.yaml declares no controller."""
TORQUE_ERROR = 1e-3
"""Standard deviation (1σ) of an instant's torque relative to the joint's effort, and number of independent ones per second."""
INDEPENDENT_HZ = 40.0
_INSTANTS_A_HARMONIC = 20
_INSTANTS_HZ = 20.0
"""Least number of instants per second: with fewer, a fast arm passes through itself between two of them, and the repair costs more."""
_SCREENING, _REFINING = (0.3,), (0.1, 0.03, 0.01)
_REPAIRS = 12
_SHRINKING, _SMALLEST = 0.97, 0.05
"""Factor by which a motion beyond a limit is reduced, and the size below which it is given up."""


@dataclass(frozen=True, eq=False)
class TrajectoryDesign:
    """Design of a `plan`: for each of its trajectories the information (r, r) on the base `columns` after it, all before it included.

    `limits` are those that it keeps, `goal` is what it was designed for, `merits` how much of that there is after each trajectory.
    `clearance` is the least distance of bodies beyond their margins, m, up to 0.05; None where the URDF has no shapes that could collide.
    """

    model: RobotModel
    plan: TrajectoryPlan
    columns: BaseRegressor
    limits: MotionLimits
    goal: ExcitationCriterion
    merits: tuple[float, ...]
    information: tuple[np.ndarray, ...]
    clearance: float | None

    def shares(self, motion: np.ndarray) -> dict[str, np.ndarray]:
        """Fractions (N, n) of the limits used by q, q̇, q̈ (3, N, n); motor torques are with friction, quantities without limit are left
        out.
        """
        return self.limits.shares(motion, self.columns)

    def largest_shares(self) -> dict[str, float]:
        """Largest fraction of each limit over all trajectories, at instants 0.1 % of a period apart."""
        plan = self.plan
        time = np.arange(1000) / (1000 * plan.base_frequency_hz)
        each = [self.shares(np.array(plan.motion(number, time))) for number in range(len(plan))]
        return {key: max(float(np.abs(shares[key]).max()) for shares in each) for key in each[0]}

    def prior_gain(self) -> dict[str, float]:
        """Ratio of the standard deviation after all trajectories to that of robot.yaml's prior, of everything in that prior."""
        unknowns = declared_unknowns(self.columns)
        known = np.diag(unknowns.prior) > 0
        covariance = np.linalg.pinv(unknowns.information(self.information[-1]), hermitian=True)
        after = np.sqrt(np.diag(covariance))
        return {name: float(std) for name, std, has in zip(unknowns.names, after, known, strict=True) if has}


def optimise_trajectories(
    model: RobotModel,
    count: int = 1,
    *,
    criterion: TrajectoryCriterion = "condition",
    of: Sequence[str] = (),
    kind: Kind = "fourier",
    duration: float = 10.0,
    base_frequency_hz: float | None = None,
    harmonics: int = 5,
    sequence: Sequence[Stage] = (),
    after: TrajectoryPlan | None = None,
    rest: bool = False,
    start: np.ndarray | None = None,
    share: float = 1.0,
    payload: float | None = None,
    starts: int = 3,
    steps: int = 40,
    seed: int = 0,
    progress: Progress = silent,
) -> TrajectoryDesign:
    """Design `count` trajectories, each optimal given the previous ones, from the best of `starts` random starts.

    A trajectory lasts `duration` s beside one period to settle, and repeats itself at `base_frequency_hz` (once in the duration by
    default). It has `harmonics`, or three times as many control points where `kind` is spline; with `rest` every period begins and ends
    at rest, with `start` (n,) at this configuration and at rest. `share` of the URDF's velocities and efforts and of robot.yaml's
    accelerations may be used; position, box, speed and bodies count in full. `payload` kg is what the robot holds. Searches take at
    most `steps` steps at each height of the barrier, so that the seed decides everything. Limits hold on a grid ten times finer than
    that of the search.

    A `sequence` of stages replaces `count`: one trajectory each, with the joints and the parameters of its own, for the criterion D.
    What was recorded by another plan, `after`, counts as known.

    Raises `InputError` or `FlexcalError` where the URDF lacks velocities, efforts or masses, the duration does not hold a period, limits
    cross, the start is not possible, the robot can stand nowhere, or torques cannot tell the parameters `of`.
    """
    require_stated_limits(model)
    frequency = 1 / duration if base_frequency_hz is None else base_frequency_hz
    periods = _periods(duration, frequency)
    limits = MotionLimits.of(model, share)
    columns = BaseRegressor.of(model, payload)
    size = harmonics if kind == "fourier" else 3 * harmonics
    begin = None if start is None else np.asarray(start, dtype=float)
    space = MotionSpace.of(
        kind,
        size,
        1 / frequency,
        max(_INSTANTS_A_HARMONIC * harmonics, int(np.ceil(_INSTANTS_HZ / frequency))),
        limits,
        rest=rest or begin is not None,
        start=begin,
    )
    weights = 1 / (TORQUE_ERROR * np.array([joint.effort for joint in model.joints]))
    goal = excitation_criterion(
        columns, criterion, of, _sizes(columns, weights, limits), INDEPENDENT_HZ * duration
    )
    if sequence and criterion != "D":
        raise InputError(
            "E-DESIGN-046", "a sequence is designed by the criterion D of each stage's parameters; choose D."
        )
    program = ExcitationProblem(
        space, columns, goal, weights, limits, Clearance(CollisionChecker(model), NEAR)
    )
    if after is not None:
        if after.payload != payload or after.joint_count != model.n:
            raise InputError(
                "E-DESIGN-047", "the plan before is for another robot or payload; design both alike."
            )
        time = np.arange(space.instants) / (space.instants * after.base_frequency_hz)
        for number in range(len(after)):
            goal = goal.after(program.information(np.array(after.motion(number, time))))
    stages = sequence or (Stage(tuple(range(model.n)), ()),) * count
    rng = np.random.default_rng(seed)
    coefficients, merits, information = [], [], []
    least, compares = NEAR, program.clearance.compares
    for number, stage in enumerate(stages):
        aim = goal.about(stage.parameters) if stage.parameters else goal
        program = replace(program, merit=aim, space=space.moving(stage.moving))
        x = _designed(program, begin, starts, steps, rng, progress, number, len(stages))
        fine = program.finer(FINER)
        motion = fine.space.motion(x)
        gained = program.information(motion)
        merits.append(aim.merit(gained))
        goal = goal.after(gained)
        information.append(goal.gathered)
        coefficients.append(program.space.coefficients(x))
        least = fine.clearance.near(motion[0])[1].min(initial=least)
    progress("trajectories", 1.0)
    of_kind = FourierPaths if kind == "fourier" else SplinePaths
    controller = model.controller
    plan = TrajectoryPlan(
        name="exciting",
        paths=of_kind.of_coefficients(np.array(coefficients)),
        payload=payload,
        base_frequency_hz=frequency,
        periods=periods + SETTLE_PERIODS,
        settle_periods=SETTLE_PERIODS,
        kp=None if controller is None else np.array(controller.kp),
        kd=None if controller is None else np.array(controller.kd),
        rate_hz=RATE_HZ if controller is None else controller.rate_hz,
        torque="held",
        seed=seed,
    )
    return TrajectoryDesign(
        model,
        plan,
        columns,
        limits,
        goal,
        tuple(merits),
        tuple(information),
        float(least) if compares else None,
    )


def _periods(duration: float, frequency: float) -> int:
    if not (duration > 0 and frequency > 0):
        raise InputError("E-DESIGN-048", "duration and base frequency must be positive.")
    periods = duration * frequency
    if periods < 1 - 1e-9:
        raise InputError(
            "E-DESIGN-049",
            f"a duration of {duration:g} s is too short for the base frequency {frequency:g} Hz, whose period is {1 / frequency:g} s; "
            "make one of them larger.",
        )
    if abs(periods - round(periods)) > 1e-6:
        raise InputError(
            "E-DESIGN-050",
            f"{duration:g} s are {periods:g} periods of {frequency:g} Hz; choose a duration of whole periods.",
        )
    return round(periods)


def _sizes(columns: BaseRegressor, weights: np.ndarray, limits: MotionLimits) -> np.ndarray:
    """Root mean square (r,) of the base columns at random states within the limits, relative to the torques' noise."""
    rng = np.random.default_rng(0)
    swing = rng.uniform(-1, 1, (3, 500, len(weights)))
    velocity = np.where(np.isfinite(limits.velocity), limits.velocity, 1.0)
    half, middle = (limits.upper - limits.lower) / 2, (limits.upper + limits.lower) / 2
    motion = swing * np.array([half, velocity, velocity**2 / half])[:, None]
    motion[0] += middle
    weighted = columns.write(motion) * weights[:, None, None]
    return np.sqrt(np.mean(np.sum(weighted**2, axis=0), axis=1))


def _designed(
    program: ExcitationProblem,
    begin: np.ndarray | None,
    starts: int,
    steps: int,
    rng: np.random.Generator,
    progress: Progress,
    number: int,
    count: int,
) -> np.ndarray:
    """Coordinates of one trajectory, from the most promising start, and from further ones if its repair was too costly."""
    if begin is None:
        places = feasible_postures(program)
    else:
        require_holding_torque(program, begin)
        places = None
    tried = []
    for k in range(starts):
        progress("trajectories", (number + 0.7 * k / starts) / count)
        first = feasible_start_motion(program, places, rng)
        x = minimise(program, first, list(_SCREENING), steps)
        tried.append((_merit(program, x), k, x, first))
    best, most = tried[0][3], -np.inf
    for promised, k, x, first in sorted(tried, reverse=True):
        if promised <= most:
            break
        progress("trajectories", (number + 0.7 + 0.3 * k / starts) / count)
        kept = _kept(program, minimise(program, x, list(_REFINING), steps), first, steps)
        if (merit := _merit(program, kept)) > most:
            best, most = kept, merit
    return best


def _merit(program: ExcitationProblem, x: np.ndarray) -> float:
    return program.merit.merit(program.information(program.space.motion(x)))


def _kept(program: ExcitationProblem, x: np.ndarray, inside: np.ndarray, steps: int) -> np.ndarray:
    """Coordinates changed so that all limits hold on the finer grid: limits on the coarse one are tightened where violated.

    `inside` keeps them.
    """
    fine = program.finer(FINER)
    tight = program
    for _ in range(_REPAIRS):
        excess = fine.excess(x)
        if excess is None:
            return x
        tight = tight.tightened(excess)
        within = _smaller(tight, x, inside, tight.within)
        x = minimise(tight, within, [_REFINING[-1]], steps // 2)
    return _smaller(program, x, inside, fine.kept_by)


def _smaller(
    program: ExcitationProblem, x: np.ndarray, inside: np.ndarray, keeps: Callable[[np.ndarray], bool]
) -> np.ndarray:
    """Reduced motion: the best of the first two feasible ones between `x` and rest at its place, and between `x` and `inside`."""
    motions = [inside]
    for towards in (program.space.still(x), inside):
        share = 1.0
        while share > _SMALLEST and not keeps(towards + share * (x - towards)):
            share *= _SHRINKING
        if share > _SMALLEST:
            motions.append(towards + share * (x - towards))
    return max(motions, key=lambda y: _merit(program, y))
