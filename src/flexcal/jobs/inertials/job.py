"""Identification of link inertials from a robot.yaml and a folder of trajectories, and estimates.yaml."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flexcal.data.experiments import PLAN, FolderCell, existing_file, labels
from flexcal.data.plans import TrajectoryPlan
from flexcal.errors import InputError
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.inertials.identification import identify_inertials
from flexcal.jobs.inertials.result import InertialsIdentification
from flexcal.jobs.result_files import RunRecord, estimates_target
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent


def identify_robot_inertials(
    robot_file: Path, folder: Path, *, out: Path | None = None, command: str = "", progress: Progress = silent
) -> InertialsIdentification:
    """`identify_inertials` of the robot of a robot.yaml from the trajectories in `folder`, and storing of the block `dynamics`.

    `folder` holds the plan and its logs, as 'measure' leaves them. The robot starts from nominal with the tolerances of its `prior:`: the
    other blocks began from this one, and are kept. With `out`, estimates, results.json and report.html go to that folder. Raises
    `FlexcalError` as `identify_inertials` does, and where the folder does not hold trajectories of this robot; nothing is written then.
    """
    nominal = RobotModel.from_yaml(robot_file, estimates=False)
    source = nominal.estimates_file
    target = estimates_target(nominal, out, "dynamics")
    cell = FolderCell(folder, nominal)
    plan = cell.plan
    if not isinstance(plan, TrajectoryPlan):
        verb = "identify response" if plan.kind == "multisine" else "calibrate"
        raise InputError(
            "E-RUN-035",
            f"{folder / PLAN} is a plan of kind '{plan.kind}', not of trajectories; give the folder to 'flexcal {verb}'.",
        )
    identified = identify_inertials(nominal, plan, cell.record(plan), progress=progress)
    files = [existing_file(folder, label.name) for label in labels(plan)]
    origin = provenance([robot_file, nominal.urdf, folder / PLAN, *files], {})
    others = read_estimates(source, without="dynamics") if source.exists() else {}
    result = replace(
        identified,
        estimate=replace(identified.estimate, provenance=origin),
        estimates=target,
        record=RunRecord(origin, command),
    )
    result.store(source, out, others)
    return result
