"""Identification of drive gains from a robot.yaml and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.files.formats import provenance
from flexcal.jobs.gains.identification import identify_gains
from flexcal.jobs.gains.result import GainsIdentification
from flexcal.jobs.result_files import RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent


def identify_robot_gains(
    robot_file: Path,
    logs: Sequence[Path],
    *,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    progress: Progress = silent,
) -> GainsIdentification:
    """`identify_gains` of the robot of a robot.yaml, which is not changed.

    With `out`, results.json and report.html go to that folder. Raises `FlexcalError` as `identify_gains` does; nothing is written then.
    """
    model = RobotModel.from_yaml(robot_file, estimates=False)
    identified = identify_gains(model, logs, jobs=jobs, progress=progress)
    record = RunRecord(provenance([robot_file, model.urdf, *logs]), command)
    result = replace(identified, record=record)
    if out is not None:
        result.write(out)
    return result
