"""Calibration of the robot of a robot.yaml from files, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from flexcal.calibration.fit import LossName
from flexcal.data.poses import read_grouped_poses, read_poses, tables_of
from flexcal.files.formats import provenance, read_estimates, sha256_of
from flexcal.jobs import fleet_prior  # loaded where a prior is given
from flexcal.jobs.calibration.procedure import calibrate
from flexcal.jobs.calibration.result import Calibration
from flexcal.jobs.inputs import image_provenance, require_distinct_files
from flexcal.jobs.result_files import estimates_target
from flexcal.model.robot import DECLARED, RobotModel, declared_sha256, with_blocks
from flexcal.progress import Progress, silent


def calibrate_robot(
    robot_file: Path,
    files: Sequence[Path],
    *,
    terms: Sequence[str] | None = None,
    loss: LossName = "auto",
    secant_scale: float = 0.0,
    elasticity: Literal["reestimated", "marginalised"] = "reestimated",
    hold_out: str | None = None,
    prior: Path | None = None,
    tolerances: bool = True,
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Calibration:
    """Calibrate the robot of a robot.yaml on files of measured poses, and store the estimate as its block `calibration`.

    The robot starts from nominal and the other blocks of its estimates; stiffness found by stage 1 enters with its uncertainty. `terms`
    (None: as robot.yaml says) are names, or "auto" for those that cross-validation supports. A sigma in the files is that of the
    instrument; the scatter of robot and model are found from the points. `hold_out` names a column: the measurements with each of its
    values are left out in turn.

    `prior` is a file with the prior of other robots of the model, as `pool_fleet` writes it: of the geometry, and of the stiffness of
    springs that were not identified of this robot; `tolerances` as `calibrate` has it.

    With `out`, estimates, results.json, points.csv, arm.npz, gravity_loads.npz and report.html go to that folder, and nothing beside
    robot.yaml changes. Raises `FlexcalError` as reading and `fit_geometry` do; nothing is written then.
    """
    progress("reading", 0.0)
    files = tables_of(files)
    require_distinct_files(files)
    bare = RobotModel.from_yaml(robot_file, estimates=False)
    source = bare.estimates_file
    blocks = read_estimates(source, without="calibration") if source.exists() else {}
    target = estimates_target(bare, out, "calibration")
    model = with_blocks(bare, blocks, source)
    labels = None
    if hold_out is None:
        poses = read_poses(list(files), model)
    else:
        poses, groups = read_grouped_poses(files, model, hold_out)
        labels = hold_out, groups
    others = None if prior is None else fleet_prior.read_model_prior(prior, bare)
    springs = None
    if others is not None:
        model, springs = fleet_prior.with_stiffness(model, others.stiffness)
    progress("reading", 1.0)
    calibration = calibrate(
        model,
        poses,
        terms=terms,
        loss=loss,
        secant_scale=secant_scale,
        elasticity=elasticity,
        hold_out=labels,
        prior=None if others is None else others.geometry,
        tolerances=tolerances,
        progress=progress,
    )
    origin = provenance([robot_file, bare.urdf, *files], None, source if blocks else None, tuple(blocks))
    origin |= image_provenance(files) | {DECLARED: declared_sha256(bare, poses.targets)}
    if prior is not None:
        origin[f"input.{fleet_prior.FLEET}"] = sha256_of(prior)
    pooled = None
    if springs is not None and prior is not None:
        conflict = fleet_prior.conflict_after(springs, calibration.estimate)
        pooled = fleet_prior.PooledUse("stiffness", str(prior), springs, conflict)
    estimate = replace(calibration.estimate, provenance=origin | dict(calibration.estimate.provenance))
    result = replace(
        calibration,
        estimate=estimate,
        nominal=bare,
        stiffness=blocks.get("stiffness"),
        pooled_stiffness=pooled,
        estimates=target,
        command=command,
    ).marked()
    result.store(source, out, blocks)
    return result
