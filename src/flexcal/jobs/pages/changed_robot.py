"""Change of a robot between two folders of calibrations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.comparison import GeometryChange, compare_geometry
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.files.formats import block_sha256, sha256_of
from flexcal.files.transaction import current_path, real_path
from flexcal.jobs.result_files import read_results
from flexcal.model.robot import RobotModel
from flexcal.report.results import Run
from flexcal.report.sections import input_files

_ABOVE = 3
"""Number of folders above a result in which its robot.yaml is looked for."""


def geometry_change(
    first: Path, second: Path, one: Run, two: Run, robot: Path | None
) -> tuple[GeometryChange | None, str]:
    """Change of the geometry from one folder to the other, or None and a sentence that says why there is none."""
    if one.kind != "calibration":
        return None, ""
    if any("calibration" not in run.estimates for run in (one, two)):
        return None, "a folder has no estimates.yaml, so the robots were not compared"
    estimates = (one.estimates["calibration"], two.estimates["calibration"])
    urdf = [_digest(estimate, (".urdf", ".xml")) for estimate in estimates]
    if urdf[0] != urdf[1]:
        return None, "the two calibrations are of different URDFs, so the robots were not compared"
    file = robot or _robot_file((first, second), estimates)
    if file is None:
        return (
            None,
            "robot.yaml was not found in or above the folders; give it with --robot to compare the robots",
        )
    try:
        model, same = model_before(file, estimates)
        if urdf[0] is not None and sha256_of(model.urdf) != urdf[0]:
            return (
                None,
                f"{model.urdf} is not the URDF of these calibrations, so the robots were not compared",
            )
        models = [_as_declared(model, read_results(folder)) for folder in (first, second)]
        change = compare_geometry(models[0], *estimates, declared=models[1], same_springs=same)
    except FlexcalError as problem:
        return None, f"the robots were not compared: {problem}"
    return change, ""


def _digest(estimate: Estimate, suffixes: tuple[str, ...]) -> str | None:
    """SHA-256 of the input with one of these endings."""
    files = input_files(estimate.provenance)
    return next((digest for name, digest in files.items() if name.endswith(suffixes)), None)


def _robot_file(folders: tuple[Path, Path], estimates: tuple[Estimate, Estimate]) -> Path | None:
    """The robot.yaml of either calibration, unchanged if possible, in or above the folders or in the working folder."""
    there: list[Path] = []
    for folder in folders:
        above = real_path(folder)
        there += [above, *list(above.parents)[:_ABOVE]]
    names = [
        name.rpartition("/")[2]
        for estimate in reversed(estimates)
        for name in input_files(estimate.provenance)
        if name.endswith((".yaml", ".yml"))
    ]
    files = [f for place in [*there, Path.cwd()] for n in dict.fromkeys(names) if (f := place / n).is_file()]
    known = {_digest(estimate, (".yaml", ".yml")) for estimate in estimates}
    return next((f for f in files if sha256_of(f) in known), files[0] if files else None)


def model_before(file: Path, estimates: Sequence[Estimate]) -> tuple[RobotModel, bool]:
    """Robot without calibration, and whether all calibrations had its stiffness and inertia as their prior."""
    used = [{k: v for k, v in e.provenance.items() if k.startswith("block.")} for e in estimates]
    declared = RobotModel.from_yaml(file, estimates=False)
    if any(other != used[0] for other in used[1:]):
        return declared, False
    stored = declared.estimates_file
    if not used[0]:
        return declared, True
    if not current_path(stored).exists():
        return declared, False
    same = all(block_sha256(stored, k.removeprefix("block.")) == v for k, v in used[0].items())  # type: ignore[arg-type]
    return (RobotModel.from_yaml(file, without="calibration"), True) if same else (declared, False)


def _as_declared(model: RobotModel, results: Mapping[str, Any]) -> RobotModel:
    """Robot with its points where a calibration had them declared."""
    points = dict(model.points)
    for name, told in (results.get("points") or {}).items():
        if name in points and told.get("declared_xyz_m") is not None:
            points[name] = replace(points[name], xyz=np.array(told["declared_xyz_m"], dtype=float))
    return replace(model, points=points)
