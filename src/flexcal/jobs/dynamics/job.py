"""Identification of dynamic parameters from a robot.yaml and files, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.dynamics.estimators import ESTIMATORS, EstimatorName
from flexcal.dynamics.torque_model import velocity_options
from flexcal.files.formats import provenance, read_estimates, sha256_of
from flexcal.jobs import fleet_prior  # loaded where a prior is given
from flexcal.jobs.dynamics.identification import identify_dynamics
from flexcal.jobs.dynamics.result import DynamicsIdentification
from flexcal.jobs.result_files import RunRecord, estimates_target
from flexcal.model.robot import RobotModel, with_blocks
from flexcal.progress import Progress, silent


def identify_robot_dynamics(
    robot_file: Path,
    logs: Sequence[Path],
    *,
    hold_out: float = 0.0,
    validate: Sequence[Path] = (),
    estimator: EstimatorName = "wls",
    flexible: bool = False,
    learn_residual: bool = False,
    accept_weight: bool = False,
    prior: Path | None = None,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    on: str | None = None,
    progress: Progress = silent,
) -> DynamicsIdentification:
    """`identify_dynamics` of the robot of a robot.yaml, and storing of the block `dynamics`.

    The robot starts from nominal and the other blocks. With `out`, estimates, results.json, predictions.npz and report.html go to that
    folder. `prior` is a file with the friction of other robots of the model, as `pool_fleet` writes it. A learned residual goes beside
    the estimates as learned_residual.npz where cross-validation finds it worth anything. Raises `FlexcalError` as `identify_dynamics` does,
    and where the place of a file is taken; nothing is written then.
    """
    bare = RobotModel.from_yaml(robot_file, estimates=False)
    source = bare.estimates_file
    blocks = read_estimates(source, without="dynamics") if source.exists() else {}
    target = estimates_target(bare, out, "dynamics")
    if learn_residual:
        from flexcal.jobs.dynamics.learned_residual import LearnedDynamics

        LearnedDynamics.require_place(target)
    identified = identify_dynamics(
        with_blocks(bare, blocks, source),
        logs,
        estimator=ESTIMATORS[estimator],
        hold_out=hold_out,
        validate=validate,
        flexible=flexible,
        learn_residual=learn_residual,
        accept_weight=accept_weight,
        prior=None if prior is None else fleet_prior.read_model_prior(prior, bare),
        jobs=jobs,
        on=on,
        progress=progress,
    )
    options = {
        "estimator": estimator,
        "hold_out": hold_out,
        "friction": ", ".join(identified.friction.labels),
        "flexible": flexible,
        **velocity_options(identified.friction.terms),
    }
    used = source if blocks else None
    origin = provenance([robot_file, bare.urdf, *logs], options, used, tuple(blocks))
    everything = origin  # hashing goes through the whole logs
    if validate:
        everything = provenance([robot_file, bare.urdf, *logs, *validate], options, used, tuple(blocks))
    if prior is not None and identified.pooled is not None and identified.pooled.used:
        origin = {**origin, f"input.{fleet_prior.FLEET}": sha256_of(prior)}
        everything = {**everything, f"input.{fleet_prior.FLEET}": origin[f"input.{fleet_prior.FLEET}"]}
    result = replace(
        identified,
        estimate=replace(identified.estimate, provenance=origin),
        estimates=target,
        record=RunRecord(everything, command),
    )
    if result.learned is not None and out is None:
        result.learned.store(target)
    result.store(source, out, blocks)
    return result
