"""Identification of dynamic parameters from joint logs, and estimates.yaml."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.dynamics.diagnostics import ExternalExcess, essential_parameters, external_share, weight_shares
from flexcal.dynamics.drives import with_backlash, with_nominal_uncertainty
from flexcal.dynamics.friction import select_friction
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation, SensorOffset
from flexcal.dynamics.regression import RegressionData
from flexcal.dynamics.residual import require_scikit_learn
from flexcal.errors import InputError
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.dynamics.estimators import ESTIMATORS, EstimatorName
from flexcal.jobs.dynamics.flexible_model import require_flexible_bearings, require_flexible_drives
from flexcal.jobs.dynamics.learned_residual import LearnedDynamics
from flexcal.jobs.dynamics.result import RobotDynamics
from flexcal.jobs.inputs import require_distinct_files
from flexcal.jobs.logs import (
    HoldOutLogs,
    choose_preprocessing,
    preprocessing_document,
    scratch_folder,
    weight_faults,
)
from flexcal.jobs.result_files import estimates_target, store_block, write_predictions, write_results
from flexcal.model.robot import RobotModel, with_blocks
from flexcal.progress import Progress, silent


def identify_robot_dynamics(
    robot: Path,
    logs: Sequence[Path],
    *,
    hold_out: float = 0.0,
    validate: Sequence[Path] = (),
    estimator: EstimatorName = "wls",
    flexible: bool = False,
    learn_residual: bool = False,
    accept_weight: bool = False,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    progress: Progress = silent,
) -> RobotDynamics:
    """Fit link inertials, rotor inertias and friction of a robot.yaml to joint logs, and store the block `dynamics`.

    Logs are read in blocks, in so many `jobs` (processes) at once, and filtered into temporary files, which take 96 bytes a sample of
    six joints, and 48 for their arm sides. The last share `hold_out` (0 to 1) of the time of every log is kept out of the fit, with what
    the filters would carry over, and predicted instead; or the logs `validate` are. The robot starts from nominal and the other blocks.
    With `out`, estimates, results.json, predictions.npz and report.html go to that folder. Raises `FlexcalError` where the logs do not
    fit the robot, for a log with a payload, for one that is given twice, and for torques unlike the links' weight, unless these are to
    be accepted (`accept_weight`); nothing is written then. Where robot.yaml declares a force sensor, its columns are the external torques.
    A cut-off or decimation that robot.yaml lacks is proposed. `flexible` tells motors and arm of the elastic joints apart (Eq. 2.22), by
    logs that have the arm side, and estimates the drives' springs; friction terms are chosen before that, as if the robot were rigid. All
    estimators but `wls`, `ols` and `sdp`, and learning, go through the logs again, in this process alone. `learn_residual` learns what the
    estimate misses of the torques, writes it beside the estimates as learned_residual.npz where cross-validation finds it worth anything,
    and changes nothing else; raises `FlexcalError` without scikit-learn, and `InputError` for a `flexible` robot.
    """
    if learn_residual:
        _require_rigid_and_learnable(flexible)
    begun = time.perf_counter()
    require_distinct_files(logs, validate)
    bare = RobotModel.from_yaml(robot, estimates=False)
    source = bare.path.parent / bare.config.estimates
    blocks = read_estimates(source, without="dynamics") if source.exists() else {}
    target = estimates_target(source, out, "dynamics")
    if learn_residual:
        LearnedDynamics.require_place(target)
    model = with_blocks(bare, blocks, source)
    springs = require_flexible_drives(model, [*logs, *validate], estimator) if flexible else ()
    bearings = require_flexible_bearings(model, [*logs, *validate]) if flexible else ()
    treatment = choose_preprocessing(model, logs, flexible=flexible)

    with scratch_folder() as folder:
        divided = HoldOutLogs.read(
            logs,
            validate,
            hold_out,
            model,
            treatment,
            folder,
            accept_weight=accept_weight,
            jobs=jobs,
            progress=progress,
        )
        declared = model.config.dynamics.friction
        friction = select_friction(model, declared, divided.equations, treatment.decimation)
        sensor = model.config.force_sensor
        shifted = sensor is not None and sensor.offset == "estimated"
        terms = (*friction.terms, SensorOffset()) if shifted else friction.terms
        observation = with_backlash(Observation(model, terms, springs, bearings), divided.equations)
        base = BaseParameters.of(observation)
        systems = divided.equations(observation)
        train = RegressionData.of(observation, base, systems)
        held_out = None
        if divided.unseen:
            held_out = RegressionData.of(observation, base, divided.unseen_equations(observation))
        rows = divided.rows(observation, base)
        estimate = with_nominal_uncertainty(train, ESTIMATORS[estimator](train, rows))
        essential = essential_parameters(train, estimate)
        if friction.spread is not None:
            estimate = friction.spread.widened(estimate)
        external = None
        if model.force_sensor is not None:
            wide = replace(observation, terms=(*observation.terms, ExternalExcess()))
            external = external_share(RegressionData.of(wide, base, divided.equations(wide)))
        learned = None
        if learn_residual:
            unseen = divided.unseen_rows(observation, base)
            learned = LearnedDynamics.of(rows, systems, unseen, estimate, progress)
        options = {
            "estimator": estimator,
            "hold_out": hold_out,
            "friction": ", ".join(friction.labels),
            "flexible": flexible,
        }
        used = source if blocks else None
        origin = provenance([robot, bare.urdf, *logs], options, used, tuple(blocks))
        estimate = replace(estimate, provenance=origin)
        plain = observation if terms == CLASSIC else replace(observation, terms=CLASSIC)
        result = RobotDynamics(
            estimate=estimate,
            estimator=estimator,
            structural_rank=base.rank if plain is observation else BaseParameters.of(plain).rank,
            train=train,
            held_out=held_out,
            hold_out=hold_out,
            validated=tuple(validate),
            essential=essential,
            friction=friction,
            motors=observation.motors,
            treatment=treatment,
            signals=preprocessing_document(treatment, divided.logs),
            weight_faults=tuple(weight_faults(divided.logs, model)),
            weight_shares={} if accept_weight else weight_shares(train, estimate),
            external=external,
            learned=learned,
            seconds=time.perf_counter() - begun,
            estimates=target,
            provenance=provenance([robot, bare.urdf, *logs, *validate], options, used, tuple(blocks)),
            command=command,
        )
        store_block(source, target, blocks, "dynamics", estimate)
        if learned is not None:
            learned.store(target)
        if out is not None:
            from flexcal.jobs.pages import report_folder

            write_results(out, result.document())
            write_predictions(out, divided.predictions(observation, estimate))
            report_folder(out)
        return result


def _require_rigid_and_learnable(flexible: bool) -> None:
    require_scikit_learn()
    if flexible:
        raise InputError(
            "a residual torque is learned for rigid joints, as a function of the motors' states; leave out one of --learn-residual and "
            "--flexible."
        )
