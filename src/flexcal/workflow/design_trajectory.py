"""Design of exciting trajectories."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data import TrajectoryPlan, page_beside, read_plan_of, write_plan
from flexcal.design import TrajectoryDesign, design_trajectories, sequence
from flexcal.design.condition import condition_number
from flexcal.design.motion_space import Kind
from flexcal.design.sequences import SequenceName
from flexcal.design.torque_columns import TorqueColumns
from flexcal.design.torque_goal import TrajectoryCriterion
from flexcal.errors import InputError
from flexcal.estimates_file import provenance
from flexcal.model import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.trajectory_design import write_trajectory_page


@dataclass(frozen=True)
class TrajectoryRequest:
    """What is asked of a design; see `design_trajectories`. The defaults are those of stage 0 of the demonstration."""

    count: int = 3
    criterion: TrajectoryCriterion = "posterior"
    of: tuple[str, ...] = ()
    sequence: SequenceName | None = None
    after: Path | None = None
    kind: Kind = "fourier"
    duration: float = 10.0
    base_frequency_hz: float = 0.2
    harmonics: int = 5
    rest: bool = False
    start: tuple[float, ...] = ()
    share: float = 0.8
    loaded: bool = False
    starts: int = 1
    steps: int = 20
    seed: int = 0

    def design(self, nominal: RobotModel, progress: Progress = silent) -> TrajectoryDesign:
        """Design for a robot. Raises `FlexcalError` as `design_trajectories` does, and for a start of another number of joints."""
        if self.start and len(self.start) != nominal.n:
            raise InputError(
                f"the start has {len(self.start)} positions, but {nominal.name} has {nominal.n} joints; give one each."
            )
        loaded = self.loaded or any(name.startswith("payload.") for name in self.of)
        return design_trajectories(
            nominal,
            self.count,
            criterion=self.criterion,
            of=self.of,
            sequence=() if self.sequence is None else sequence(TorqueColumns.of(nominal), self.sequence),
            after=None if self.after is None else read_plan_of(self.after, TrajectoryPlan),
            kind=self.kind,
            duration=self.duration,
            base_frequency_hz=self.base_frequency_hz,
            harmonics=self.harmonics,
            rest=self.rest,
            start=np.array(self.start) if self.start else None,
            share=self.share,
            payload=None if loaded or nominal.payload is None else 0.0,
            starts=self.starts,
            steps=self.steps,
            seed=self.seed,
            progress=progress,
        )


@dataclass(frozen=True, eq=False)
class DesignedTrajectories:
    """A design, the file that its plan was written to, what it comes from, and the command line, where there was one."""

    design: TrajectoryDesign
    file: Path
    provenance: Mapping[str, str]
    command: str = ""

    @property
    def page(self) -> Path:
        """Where the pictures are: beside the plan."""
        return page_beside(self.file)

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
            "condition": condition_number(design.information[-1]),
            "merits": list(design.merits),
            "largest_shares": design.largest_shares(),
            "clearance": design.clearance,
            "prior_gain": design.prior_gain(),
            "page": self.page,
            "seed": plan.seed,
            "provenance": dict(self.provenance),
            "command": self.command,
        }


def plan_trajectories(
    robot: Path, out: Path, request: TrajectoryRequest, *, command: str = "", progress: Progress = silent
) -> DesignedTrajectories:
    """Write exciting trajectories of the nominal robot to the file `out`, and a page of pictures beside it.

    Raises `FlexcalError` as `design_trajectories` does.
    """
    nominal = RobotModel.from_yaml(robot, estimates=False)
    origin = provenance([robot, nominal.urdf, *(() if request.after is None else (request.after,))])
    found = DesignedTrajectories(request.design(nominal, progress), out, origin, command)
    write_trajectory_page(found.page, found.design, found.document())
    write_plan(out, found.design.plan)
    return found


def exciting_plan(nominal: RobotModel, *, count: int = 3, seed: int) -> TrajectoryPlan:
    """Trajectories without payload that tell most of masses, centres of mass and rotors beside robot.yaml's prior."""
    return TrajectoryRequest(count=count, seed=seed).design(nominal).plan
