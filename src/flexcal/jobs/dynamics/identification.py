"""Identification of dynamic parameters: a robot model and its joint logs in, an estimate with its predictions out."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from flexcal.dynamics.diagnostics import ExternalExcess, essential_parameters, external_share, weight_shares
from flexcal.dynamics.drives import with_backlash, with_nominal_uncertainty
from flexcal.dynamics.estimators import WLS, Estimator
from flexcal.dynamics.friction import select_friction
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation, SensorOffset
from flexcal.dynamics.regression import RegressionData
from flexcal.errors import InputError
from flexcal.jobs import fleet_prior  # loaded where a prior is given
from flexcal.jobs.dynamics.encoder_bias import without_encoder_bias
from flexcal.jobs.dynamics.flexible_model import require_flexible_bearings, require_flexible_drives
from flexcal.jobs.dynamics.result import DynamicsIdentification
from flexcal.jobs.inputs import require_distinct_files
from flexcal.jobs.logs import (
    HoldOutLogs,
    JointLogs,
    choose_preprocessing,
    log_files,
    log_names,
    model_for_logs,
    preprocessing_document,
    scratch_folder,
    weight_faults,
    worker_robot,
)
from flexcal.model.robot import DynamicsConfig, RobotModel
from flexcal.parallel import ThisProcess, open_workers
from flexcal.progress import Progress, silent

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from flexcal.estimation import Estimate
    from flexcal.jobs.fleet_prior import ModelPrior

_DEFAULT = WLS()
_FACTORS_SUFFICE = ("wls", "ols", "sdp")
"""Estimators that go through no log again."""


def identify_dynamics(
    model: RobotModel,
    logs: JointLogs,
    *,
    estimator: Estimator = _DEFAULT,
    friction: str | tuple[str, ...] | None = None,
    hold_out: float = 0.0,
    validate: JointLogs = (),
    flexible: bool = False,
    learn_residual: bool = False,
    accept_weight: bool = False,
    prior: ModelPrior | None = None,
    jobs: int = 1,
    on: str | None = None,
    progress: Progress = silent,
) -> DynamicsIdentification:
    """Fit link inertials, rotor inertias and friction of a robot to joint logs.

    What robot.yaml leaves open is chosen: the cut-off by cross-validation, the friction terms by cross-validation and significance.

    Parameters
    ----------
    model : RobotModel
        Nominal robot, with `model.config.dynamics` as robot.yaml declares it.
    logs : sequence of path or Recording
        Joint logs of unloaded motions, as files or in memory, there in SI units of the joints. Files are read in blocks and filtered into
        temporary files, which take 96 bytes a sample of six joints, and 48 for their arm sides.
    estimator : Estimator
        All but `WLS`, `OLS` and `SDP`, and learning, go through the logs again, in this process alone.
    friction : str or tuple of str, optional
        "auto", "classic" or names of terms, as `dynamics: friction:` of robot.yaml, whose entry is taken by default.
    hold_out : float
        Share (0 to 1) at the end of every log that is predicted instead of fitted, with what the filters would carry over.
    validate : sequence of path or Recording
        Logs that are predicted instead of fitted.
    flexible : bool
        Whether motors and arm of the elastic joints have equations of their own (Eq. 2.22), by logs that have the arm side, and the
        drives' springs are estimated; friction terms are chosen before that, as if the robot were rigid.
    learn_residual : bool
        Whether to learn what the estimate misses of the torques; needs scikit-learn.
    accept_weight : bool
        Whether torques unlike the links' weight are accepted, as of balanced arms and guessed masses.
    prior : ModelPrior, optional
        Friction of other robots of the model, the prior of that of this one where it fits; where it does not, by a test, it is not used.
    jobs : int
        Number of logs read in parallel, each in its own process.
    on : str, optional
        Address of a Dask scheduler, dask://host:port, whose workers read the logs instead. They find the files of logs and robot under the
        same paths; where they do not see this machine's temporary files, they filter each log anew for every pass.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    DynamicsIdentification
        Its `estimate`, `model`, `residuals`, `summary()` and `report(path)`. Where the robot declares a force sensor, its columns are
        the external torques.

    Raises
    ------
    FlexcalError
        Where the logs do not fit the robot, for a log with a payload, one that is given twice, torques unlike the links' weight; with
        `learn_residual` for a `flexible` robot or without scikit-learn.

    Examples
    --------
    >>> from flexcal import RobotModel, identify_dynamics
    >>> model = RobotModel.from_yaml("examples/tx40/robot.yaml")
    >>> dynamics = identify_dynamics(model, ["examples/tx40/exciting.parquet"], friction="classic")
    >>> dynamics.estimate.rank
    61
    >>> dynamics.residuals[0].shape[1]
    6
    """
    if learn_residual:
        _require_rigid_and_learnable(flexible)
    begun = time.perf_counter()
    model = model_for_logs(model, [*logs, *validate])
    with scratch_folder() as folder, open_workers(on, jobs) as workers:
        model = worker_robot(model, workers)
        files, others = log_files(logs, folder, "log"), log_files(validate, folder, "validation")
        require_distinct_files(files, others)
        springs = require_flexible_drives(model, [*files, *others], estimator.name) if flexible else ()
        bearings = require_flexible_bearings(model, [*files, *others]) if flexible else ()
        preprocessing = choose_preprocessing(model, files, flexible=flexible, workers=workers)
        divided = HoldOutLogs.read(
            files,
            others,
            hold_out,
            model,
            preprocessing,
            folder,
            accept_weight=accept_weight,
            joined=estimator.name in _FACTORS_SUFFICE and not learn_residual,
            workers=workers,
            progress=progress,
        )
        declared = (model.config.dynamics if friction is None else DynamicsConfig(friction=friction)).friction
        selection = select_friction(model, declared, divided.equations, preprocessing.decimation)
        sensor = model.config.force_sensor
        shifted = sensor is not None and sensor.offset == "estimated"
        terms = (*selection.terms, SensorOffset()) if shifted else selection.terms
        observation = with_backlash(Observation(model, terms, springs, bearings), divided.equations)
        base = BaseParameters.of(observation)
        systems = divided.equations(observation)
        train = RegressionData.of(observation, base, systems)
        held_out = None
        if divided.unseen:
            held_out = RegressionData.of(observation, base, divided.unseen_equations(observation))
        rows = divided.rows(observation, base)
        estimate = with_nominal_uncertainty(train, estimator.fit(train, rows))
        encoders = None
        if springs:

            def refit(robot: RobotModel, copies: Sequence[Path], filtered: Path) -> Estimate:
                again = HoldOutLogs.read(
                    copies,
                    (),
                    hold_out,
                    robot,
                    preprocessing,
                    filtered,
                    accept_weight=True,
                    workers=ThisProcess(),
                    progress=silent,
                )
                data = RegressionData.of(observation, base, again.equations(observation))
                return estimator.fit(data, again.rows(observation, base))

            estimate, encoders = without_encoder_bias(model, files, estimate, refit)
        essential = essential_parameters(train, estimate)
        if selection.uncertainty is not None:
            estimate = selection.uncertainty.widened(estimate)
        use = None
        if prior is not None:
            estimate, use = fleet_prior.with_friction(estimate, prior, ", ".join(selection.labels))
        external = None
        if model.force_sensor is not None:
            wide = replace(observation, terms=(*observation.terms, ExternalExcess()))
            external = external_share(RegressionData.of(wide, base, divided.equations(wide)))
        learned = None
        if learn_residual:
            from flexcal.jobs.dynamics.learned_residual import LearnedDynamics

            unseen = divided.unseen_rows(observation, base)
            learned = LearnedDynamics.of(rows, systems, unseen, estimate, progress)
        plain = observation if terms == CLASSIC else replace(observation, terms=CLASSIC)
        return DynamicsIdentification(
            model=model.with_estimate(estimate),
            estimate=estimate,
            estimator=estimator.name,
            structural_rank=base.rank if plain is observation else BaseParameters.of(plain).rank,
            train=train,
            held_out=held_out,
            hold_out=hold_out,
            validated=log_names(others, folder),
            essential=essential,
            friction=selection,
            motors=observation.motors,
            preprocessing=preprocessing,
            signals=preprocessing_document(preprocessing, divided.logs),
            weight_faults=tuple(weight_faults(divided.logs, model)),
            weight_shares={} if accept_weight else weight_shares(train, estimate),
            external=external,
            encoders=encoders,
            learned=learned,
            pooled=use,
            predictions=tuple(divided.predictions(observation, estimate)),
            seconds=time.perf_counter() - begun,
        )


def _require_rigid_and_learnable(flexible: bool) -> None:
    from flexcal.dynamics.residual import require_scikit_learn

    require_scikit_learn()
    if flexible:
        raise InputError(
            "E-RUN-034",
            "a residual torque is learned for rigid joints, as a function of the motors' states; leave out one of --learn-residual and "
            "--flexible.",
        )
