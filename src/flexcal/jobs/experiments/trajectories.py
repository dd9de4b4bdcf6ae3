"""Design of exciting trajectories."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.data.plans import TrajectoryPlan, page_beside, read_plan_of, write_plan
from flexcal.design.optimality import condition_number
from flexcal.design.trajectories import (
    COULOMB,
    VISCOUS,
    BaseRegressor,
    Kind,
    SequenceName,
    TimedMotion,
    TrajectoryCriterion,
    TrajectoryDesign,
    optimise_trajectories,
    require_stated_limits,
    sequence,
    timed_motion,
    with_assumed_friction,
)
from flexcal.errors import InputError
from flexcal.files.formats import provenance
from flexcal.jobs.pages import PlottedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.layout import Page
from flexcal.report.pages import trajectory_page

SEARCHES = 3
ALIKE = 1.3
"""Ratio of the condition numbers of searches above which they are reported."""
LEAST_RATE_HZ = 100.0
"""Least rate of timed joint positions if none is requested; higher for fast motions."""
_INSTANTS_A_PERIOD = 50
"""Samples per period of the highest harmonic."""
_NEXT_SEED = 7919


@dataclass(frozen=True)
class TrajectoryRequest:
    """Requested exciting trajectories of `design_trajectories`.

    Parameters
    ----------
    count : int
        Number of trajectories, each optimised given those before it.
    criterion : {"compound", "posterior", "condition", "D", "E", "A", "c"}
        posterior: masses, centres of mass and rotors, with the prior of robot.yaml; condition: condition number of the column-scaled
        observation matrix; compound: both; D, E, A: of the base parameters without prior; c: variances of the parameters `of`.
    of : tuple of str
        Parameters of the criterion c, such as link_3.mass.
    sequence : {"links", "axes", "kinds"}, optional
        One trajectory for each link from the last on, for wrist and main axes, or for inertia, gravity and friction; with criterion D.
    after : TrajectoryPlan, optional
        Plan that is recorded already; its information is added.
    kind : {"fourier", "spline"}
        Fourier series, or cyclic B-splines with three control points for each of the harmonics.
    duration, base_frequency_hz : float
        Length of a trajectory, s, without one period to settle, and base frequency, Hz.
    harmonics : int
        Number of multiples of the base frequency.
    rest : bool
        Whether every period begins and ends at rest.
    start : tuple of float
        Joint positions (n,), rad or m, where every period begins and ends at rest.
    share : float
        Share of the limits of velocities, accelerations and torques that a motion may use.
    loaded : bool
        Whether the declared payload is held.
    searches, steps, seed : int
        Number of searches, each from a random start, of which the best is kept; iterations at each level of the barrier; seed.
    """

    count: int = 3
    criterion: TrajectoryCriterion = "compound"
    of: tuple[str, ...] = ()
    sequence: SequenceName | None = None
    after: TrajectoryPlan | None = None
    kind: Kind = "fourier"
    duration: float = 10.0
    base_frequency_hz: float = 0.2
    harmonics: int = 5
    rest: bool = False
    start: tuple[float, ...] = ()
    share: float = 0.8
    loaded: bool = False
    searches: int = SEARCHES
    steps: int = 20
    seed: int = 0

    def optimise(self, nominal: RobotModel, progress: Progress = silent) -> list[TrajectoryDesign]:
        """Designs of all searches, best first.

        Raises `FlexcalError` as `design_trajectories` does, and for a start of another number of joints.
        """
        if self.start and len(self.start) != nominal.n:
            raise InputError(
                "E-RUN-043",
                f"the start has {len(self.start)} positions, but {nominal.name} has {nominal.n} joints; give one each.",
            )

        def onward(search: int) -> Progress:
            return lambda stage, share: progress(stage, (search + share) / self.searches)

        designs = [self._search(nominal, search, onward(search)) for search in range(self.searches)]
        return sorted(designs, key=lambda design: -design.merits[-1])

    def _search(self, nominal: RobotModel, search: int, progress: Progress) -> TrajectoryDesign:
        loaded = self.loaded or any(name.startswith("payload.") for name in self.of)
        design = optimise_trajectories(
            nominal,
            self.count,
            criterion=self.criterion,
            of=self.of,
            sequence=() if self.sequence is None else sequence(BaseRegressor.of(nominal), self.sequence),
            after=self.after,
            kind=self.kind,
            duration=self.duration,
            base_frequency_hz=self.base_frequency_hz,
            harmonics=self.harmonics,
            rest=self.rest,
            start=np.array(self.start) if self.start else None,
            share=self.share,
            payload=None if loaded or nominal.payload is None else 0.0,
            starts=1,
            steps=self.steps,
            seed=self.seed + _NEXT_SEED * search,
            progress=progress,
        )
        return replace(design, plan=replace(design.plan, seed=self.seed))


DEFAULT_REQUEST = TrajectoryRequest()


@dataclass(frozen=True, eq=False, repr=False)
class DesignedTrajectories(PlottedResult):
    """Result of `design_trajectories`: the designs of all searches, best first.

    Attributes
    ----------
    model : RobotModel
        The robot that the plan is for.
    designs : list of TrajectoryDesign
        Designs of all searches, best first.
    timed : tuple of TimedMotion
        Trajectories of the best design as timed joint positions.
    rate_hz : float
        Joint positions per second in `timed`.
    assumed_friction : tuple of str
        Joints whose friction robot.yaml does not give.
    file : Path or None
        File of the plan, where it was written.
    ros : {"yaml", "mcap"}
        Format of the ROS messages beside the plan.
    record : RunRecord
        What the result comes from.
    """

    designs: list[TrajectoryDesign]
    timed: tuple[TimedMotion, ...]
    rate_hz: float
    assumed_friction: tuple[str, ...]
    file: Path | None = None
    ros: Literal["yaml", "mcap"] = "yaml"
    record: RunRecord = NOT_RECORDED

    @property
    def plan(self) -> TrajectoryPlan:
        """Plan of the trajectories."""
        return self.design.plan

    @property
    def headline(self) -> str:
        """Length and condition number."""
        plan = self.plan
        return f"{len(plan)} trajectories, {len(plan) * plan.duration:.0f} s, condition number {self.conditions[0]:.3g}"

    def summary(self) -> str:
        """Length, condition number and remarks."""
        return "\n".join([self.headline, *self.remarks])

    def _page(self) -> Page:
        return trajectory_page(self.design, self.document())

    @property
    def design(self) -> TrajectoryDesign:
        """Best design."""
        return self.designs[0]

    @property
    def page(self) -> Path | None:
        """Path of the page beside the plan; None if the plan was not written."""
        return None if self.file is None else page_beside(self.file)

    @property
    def timed_files(self) -> list[tuple[Path, Path]]:
        """Paths of CSV and ROS message of every trajectory, beside the plan."""
        plan = Path("trajectory.yaml") if self.file is None else self.file
        stems = [f"{plan.stem}_{number}" for number in range(1, len(self.timed) + 1)]
        return [(plan.with_name(f"{stem}.csv"), plan.with_name(f"{stem}_ros.{self.ros}")) for stem in stems]

    @cached_property
    def conditions(self) -> list[float]:
        """Condition numbers of all searches, that of the plan first."""
        return [condition_number(design.information[-1]) for design in self.designs]

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the plan's assumptions, one sentence each."""
        remarks = []
        if self.assumed_friction:
            remarks.append(
                f"robot.yaml gives no friction of {', '.join(self.assumed_friction)}: {100 * COULOMB:.0f} % of the effort and "
                f"{100 * VISCOUS:.0f} % more at the velocity limit are left free for it; for the torques that the drives really have left, "
                "give `drives:` with `coulomb:` (N m) and `viscous:` (N m s/rad), for example of a first 'flexcal identify dynamics'"
            )
        if self.design.clearance is None:
            remarks.append(
                "the URDF has no collision shapes, so collisions are not excluded: run the motion in a simulator, or slowly, first"
            )
        least, most, kept = min(self.conditions), max(self.conditions), self.conditions[0]
        if most > ALIKE * least:
            remarks.append(
                f"the {len(self.designs)} searches differ: their condition numbers are {least:.3g} to {most:.3g}, and {kept:.3g} of the "
                "kept one, the best by its criterion; more searches may find a better plan (--searches 10)"
            )
        for motion, (file, _) in zip(self.timed, self.timed_files, strict=True):
            what, share = max(motion.largest_shares.items(), key=lambda item: item[1])
            if share > 1:
                remarks.append(
                    f"{file} takes {100 * share:.0f} % of the permitted {what} while it gets up speed; let the controller slow it down"
                )
        return tuple(remarks)

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        design, plan = self.design, self.design.plan
        return {
            "plan": self.file,
            "trajectories": len(plan),
            "base_frequency_hz": plan.base_frequency_hz,
            "periods": plan.periods,
            "payload": plan.payload,
            "seconds_on_the_robot": len(plan) * plan.duration,
            "base_parameters": design.columns.rank,
            "condition": self.conditions[0],
            "searches": [
                {"condition": condition, "merit": searched.merits[-1]}
                for condition, searched in zip(self.conditions, self.designs, strict=True)
            ],
            "criterion": design.goal.criterion.name,
            "merits": list(design.merits),
            "largest_shares": design.largest_shares(),
            "clearance": design.clearance,
            "prior_gain": design.prior_gain(),
            "assumed_friction": list(self.assumed_friction),
            "timed": [
                {
                    "csv": csv,
                    "ros": ros,
                    "rate_hz": self.rate_hz,
                    "seconds": float(motion.positions.time[-1]),
                    "run_up_s": motion.run_up,
                }
                for motion, (csv, ros) in zip(self.timed, self.timed_files, strict=True)
            ],
            "remarks": list(self.remarks),
            "page": self.page,
            "seed": plan.seed,
            **self.record.document(),
        }


def design_trajectories(
    model: RobotModel,
    request: TrajectoryRequest = DEFAULT_REQUEST,
    *,
    rate_hz: float | None = None,
    progress: Progress = silent,
) -> DesignedTrajectories:
    """Plan exciting trajectories: periodic motions within all limits and without collision that best determine the robot's dynamics.

    Parameters
    ----------
    model : RobotModel
        Nominal robot with limits of position, velocity and torque.
    request : TrajectoryRequest
        Number, kind and length of the trajectories, and the criterion.
    rate_hz : float, optional
        Timed joint positions a second; by default 100, more where a motion is fast.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    DesignedTrajectories
        Its `plan`, `timed` joint positions, `conditions`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where limits are missing, a start has another number of joints, or no motion within the limits is found.

    Examples
    --------
    One step of one search, for a quick plan that is not yet a good one:

    >>> from flexcal import RobotModel, TrajectoryRequest, design_trajectories
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> request = TrajectoryRequest(count=1, criterion="posterior", duration=5.0, harmonics=2, searches=1, steps=1)
    >>> len(design_trajectories(model, request).plan)
    1
    """
    require_stated_limits(model)
    known, assumed = with_assumed_friction(model)
    if rate_hz is None:
        rate_hz = max(LEAST_RATE_HZ, _INSTANTS_A_PERIOD * request.harmonics * request.base_frequency_hz)
    designs = request.optimise(known, progress)
    timed = tuple(timed_motion(designs[0], number, rate_hz) for number in range(len(designs[0].plan)))
    return DesignedTrajectories(model, designs, timed, rate_hz, assumed)


def plan_trajectories(
    robot_file: Path,
    out: Path,
    request: TrajectoryRequest,
    *,
    after: Path | None = None,
    rate_hz: float | None = None,
    ros: Literal["yaml", "mcap"] = "yaml",
    command: str = "",
    progress: Progress = silent,
) -> DesignedTrajectories:
    """`design_trajectories` for the nominal robot of a robot.yaml, after the recorded plan of the file `after`.

    The plan goes to the file `out`; beside it a page of pictures, and the motions as timed positions, in CSV and as
    `ros` messages. Raises `FlexcalError` as `design_trajectories` does.
    """
    nominal = RobotModel.from_yaml(robot_file, estimates=False)
    if after is not None:
        request = replace(request, after=read_plan_of(after, TrajectoryPlan))
    origin = provenance([robot_file, nominal.urdf, *(() if after is None else (after,))])
    designed = design_trajectories(nominal, request, rate_hz=rate_hz, progress=progress)
    result = replace(designed, file=out, ros=ros, record=RunRecord(origin, command))
    result.report(page_beside(out))
    for motion, (csv, message) in zip(result.timed, result.timed_files, strict=True):
        motion.positions.write_csv(csv)
        motion.positions.write_ros(message)
    write_plan(out, result.plan)
    return result


def exciting_plan(nominal: RobotModel, *, count: int = 3, seed: int) -> TrajectoryPlan:
    """Exciting trajectories of stage 0 of the demonstration: without payload, of one search, by the criterion posterior.

    Parameters
    ----------
    nominal : RobotModel
        Nominal robot with limits of position, velocity and torque.
    count : int
        Number of trajectories.
    seed : int
        Seed of the start of the search.

    Returns
    -------
    TrajectoryPlan
        Trajectories within all limits and without collision.

    Raises
    ------
    FlexcalError
        As `design_trajectories` does.

    Examples
    --------
    >>> from flexcal import RobotModel, exciting_plan
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> plan = exciting_plan(model, count=1, seed=0)
    >>> print(f"{len(plan)} trajectory of {plan.duration:.0f} s")
    1 trajectory of 15 s
    """
    request = TrajectoryRequest(count=count, criterion="posterior", searches=1, seed=seed)
    return request.optimise(nominal)[0].plan
