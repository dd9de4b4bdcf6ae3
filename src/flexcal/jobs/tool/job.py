"""Identification of a tool from a robot.yaml and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.data.poses import read_touches
from flexcal.files.formats import provenance
from flexcal.jobs.inputs import probable_model, require_distinct_files
from flexcal.jobs.result_files import RunRecord, write_results
from flexcal.jobs.tool.identification import identify_tip
from flexcal.jobs.tool.result import ToolIdentification


def identify_tool(
    robot_file: Path,
    files: Sequence[Path],
    *,
    frame: str | None = None,
    name: str = "tip",
    estimates: Path | None = None,
    out: Path | None = None,
    command: str = "",
) -> ToolIdentification:
    """`identify_tip` of the robot of a robot.yaml with its estimates, which is not changed; with `out`, results.json goes to that folder.

    Raises `FlexcalError` as reading and `identify_tip` do; nothing is written then.
    """
    require_distinct_files(files)
    model, unseen = probable_model(robot_file, estimates)
    found = identify_tip(model, read_touches(list(files), model), frame=frame, name=name, unseen=unseen)
    found = replace(found, record=RunRecord(provenance([robot_file, model.urdf, *files]), command))
    if out is not None:
        write_results(out, found.document())
    return found
