"""Identification of a work object from a robot.yaml and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.data.poses import read_frame_touches
from flexcal.files.formats import provenance
from flexcal.jobs.frame.identification import identify_work_object
from flexcal.jobs.frame.result import FrameIdentification
from flexcal.jobs.inputs import probable_model, require_distinct_files
from flexcal.jobs.result_files import RunRecord, write_results


def identify_frame(
    robot_file: Path,
    files: Sequence[Path],
    *,
    point: str | None = None,
    name: str = "work_object",
    tip_radius: float = 0.0,
    estimates: Path | None = None,
    out: Path | None = None,
    command: str = "",
) -> FrameIdentification:
    """`identify_work_object` of the robot of a robot.yaml with its estimates; with `out`, results.json goes to that folder.

    Raises `FlexcalError` as reading and `identify_work_object` do; nothing is written then.
    """
    require_distinct_files(files)
    model, _ = probable_model(robot_file, estimates)
    given = read_frame_touches(list(files), model)
    found = identify_work_object(model, given, point=point, name=name, tip_radius=tip_radius)
    found = replace(found, record=RunRecord(provenance([robot_file, model.urdf, *files]), command))
    if out is not None:
        write_results(out, found.document())
    return found
