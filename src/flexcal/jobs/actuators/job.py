"""Identification of actuators from a robot.yaml and files, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.data.recordings import read_command_log
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.actuators.identification import Damping, identify_actuators
from flexcal.jobs.actuators.result import ActuatorIdentification
from flexcal.jobs.inputs import require_distinct_files
from flexcal.jobs.result_files import RunRecord, estimates_target
from flexcal.model.robot import RobotModel, with_blocks
from flexcal.progress import Progress, silent


def identify_robot_actuators(
    robot_file: Path,
    logs: Sequence[Path],
    *,
    damping: Damping = "velocity",
    known_gains: bool = False,
    hold_out: float = 0.25,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    progress: Progress = silent,
) -> ActuatorIdentification:
    """`identify_actuators` of the robot of a robot.yaml, and storing of the block `actuators`.

    The robot has its other estimates, inertials and payload among them. With `out`, estimates, results.json and report.html go to that
    folder. Raises `FlexcalError` as `identify_actuators` and reading do; nothing is written then.
    """
    nominal = RobotModel.from_yaml(robot_file, estimates=False)
    source = nominal.estimates_file
    target = estimates_target(nominal, out, "actuators")
    require_distinct_files(logs)
    blocks = read_estimates(source, without="actuators") if source.exists() else {}
    model = with_blocks(nominal, blocks, source)
    read = [read_command_log(path, nominal) for path in logs]
    identified = identify_actuators(
        model, read, damping=damping, known_gains=known_gains, hold_out=hold_out, jobs=jobs, progress=progress
    )
    options = {"known_gains": known_gains, "hold_out": hold_out}
    used = source if blocks else None
    origin = provenance([robot_file, nominal.urdf, *logs], options, used, tuple(blocks))
    result = replace(
        identified,
        estimate=replace(identified.estimate, provenance={**origin, **identified.estimate.provenance}),
        estimates=target,
        record=RunRecord(origin, command),
    )
    result.store(source, out, blocks)
    return result
