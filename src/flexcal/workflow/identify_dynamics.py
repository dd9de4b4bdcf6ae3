"""Recordings of exciting motion to dynamic parameters, and estimates.yaml."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from flexcal.data import provenance, read_estimates
from flexcal.dynamics import (
    CLASSIC,
    BaseParameters,
    EssentialParameters,
    ExperimentSystem,
    FrictionSelection,
    Observation,
    RecordedRows,
    RegressionData,
    Window,
    batches_each,
    essential_parameters,
    require_scikit_learn,
    select_friction,
    with_play,
)
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.model import RobotModel
from flexcal.model.pseudo_inertia import is_body
from flexcal.model.stored import with_blocks
from flexcal.progress import Progress, silent
from flexcal.workflow.distinct_logs import require_distinct
from flexcal.workflow.drive_springs import drive_springs
from flexcal.workflow.dynamics_remarks import dynamics_remarks
from flexcal.workflow.estimators import ESTIMATORS, EstimatorName
from flexcal.workflow.learned_dynamics import LearnedDynamics
from flexcal.workflow.log_payloads import require_unloaded
from flexcal.workflow.log_predictions import log_predictions
from flexcal.workflow.log_systems import LogPart, log_systems, read_logs, split
from flexcal.workflow.log_torques import require_joint_torques
from flexcal.workflow.results import dropped_parameters, quantities, write_results
from flexcal.workflow.stored_block import ESTIMATES, store_block
from flexcal.workflow.treatment import Treatment, treatment_of


@dataclass(frozen=True, eq=False)
class RobotDynamics:
    """The estimate, how well it predicts the torques it was made from and those it never saw, and where it was written.

    The last share `hold_out` of the time of every log was kept out of the fit, or the logs `validated` were. `motors` are the joints
    whose motors have equations of their own. `learned` is what was learned beside the estimate, None where nobody asked for it.
    """

    estimate: Estimate
    estimator: EstimatorName
    structural_rank: int
    train: RegressionData
    held_out: RegressionData | None
    hold_out: float
    validated: tuple[Path, ...]
    essential: EssentialParameters
    friction: FrictionSelection
    motors: tuple[str, ...]
    treatment: Treatment
    learned: LearnedDynamics | None
    seconds: float
    estimates: Path

    @property
    def bodiless(self) -> tuple[str, ...]:
        """The links whose inertials no body can have: right for torques, useless for springs and for a URDF."""
        links = (joint.link for joint in self.train.observation.model.joints)
        return tuple(link for link in links if not is_body(self.estimate.values, link))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        x = self.estimate.parameters.coordinates()
        error, each = self.train.errors(x)
        joints = self.train.observation.model.joint_names
        percent: dict[str, Any] = {"train": 100 * error, "held_out": None}
        if self.held_out is not None:
            error, each = self.held_out.errors(x)
            percent["held_out"] = 100 * error
        percent["per_joint"] = dict(zip(joints, 100 * each[: len(joints)], strict=True))
        if self.motors:
            percent["per_motor"] = dict(zip(self.motors, 100 * each[len(joints) :], strict=True))
        return {
            "structural_rank": self.structural_rank,
            "rank": self.estimate.rank,
            "equations": sum(s.triangle.rows for s in self.train.subsystems),
            "masked_rows": self.train.masked,
            "error_percent": percent,
            "hold_out": {"share": self.hold_out, "logs": [str(log) for log in self.validated]},
            "bodiless_links": list(self.bodiless),
            "signals": {
                "cutoff_hz": self.treatment.cutoff_hz,
                "decimation": self.treatment.decimation.factor,
                "proposed": list(self.treatment.proposed),
            },
            "friction_terms": list(self.friction.names),
            "friction_shapes": {c.name: c.shape for c in self.friction.chosen if c.shape},
            "friction_tried": [
                {"terms": list(t.terms), "cross_validation_percent": 100 * t.error}
                for t in self.friction.trials
            ],
            "remarks": list(dynamics_remarks(self.train, self.estimate, self.estimator)),
            "base_parameters": self._base_parameters(),
            "essential_parameters": self._essential_parameters(),
            "parameters": quantities(self.estimate),
            "dropped": dropped_parameters(self.estimate.dropped),
            "learned_residual": None if self.learned is None else self.learned.document(self.estimates),
            "seconds": self.seconds,
            "estimates": self.estimates,
        }

    def _essential_parameters(self) -> dict[str, Any]:
        """What stays of the base parameters, with value and standard deviation, and the error of the torques with it alone."""
        found = self.essential
        percent = {"train": 100 * self.train.errors(found.parameters)[0], "held_out": None}
        if self.held_out is not None:
            percent["held_out"] = 100 * self.held_out.errors(found.parameters)[0]
        stay = zip(found.names, found.values, found.std, strict=True)
        return {
            "parameters": [{"name": name, "estimate": value, "std": std} for name, value, std in stay],
            "eliminated": list(found.eliminated),
            "error_percent": percent,
        }

    def _base_parameters(self) -> list[dict[str, Any]]:
        """Value, standard deviation and that in per cent of every base parameter, written out; None where the data do not tell.

        `essential` is its value where the others are left out, None where it is left out itself.
        """
        essential = dict(zip(self.essential.names, self.essential.values, strict=True))
        base, x = self.train.base, self.estimate.parameters.coordinates()
        hidden = {entry.name for entry in self.estimate.dropped}
        rows = []
        for expression, kept, row in zip(
            base.expressions, base.found.kept, base.found.regrouping, strict=True
        ):
            name, value = base.found.names[kept], float(row @ x)
            std = None if name in hidden else self.estimate.std(name)
            percent = None if std is None or value == 0 else 100 * std / abs(value)
            unit = self.estimate.parameters[name].unit
            rows.append(
                {
                    "name": expression,
                    "unit": unit,
                    "estimate": value,
                    "std": std,
                    "std_percent": percent,
                    "essential": essential.get(name),
                }
            )
        return rows


def identify_robot_dynamics(
    robot: Path,
    logs: Sequence[Path],
    *,
    hold_out: float = 0.0,
    validate: Sequence[Path] = (),
    estimator: EstimatorName = "wls",
    flexible: bool = False,
    learn_residual: bool = False,
    out: Path | None = None,
    jobs: int = 1,
    progress: Progress = silent,
) -> RobotDynamics:
    """Fit link inertials, rotor inertias and friction of a robot.yaml to joint logs, and store the block `dynamics`.

    Logs are read in blocks, in so many `jobs` (processes) at once, and filtered into temporary files, which take 96 bytes a sample of
    six joints, and 48 for their arm sides. The last share `hold_out` (0 to 1) of the time of every log is kept out of the fit, with what
    the filters would carry over, and predicted instead; or the logs `validate` are. The robot starts from nominal and the other blocks.
    With `out`, estimates, results.json and report.html go to that folder. Raises `FlexcalError` where the logs do not fit the robot, for a
    log with a payload, and for one that is given twice; nothing is written then. A cut-off or decimation that robot.yaml lacks is
    proposed. `flexible` tells motors and arm of the elastic joints apart (Eq. 2.22), by logs that have the arm side, and estimates the
    drives' springs; friction terms are chosen before that, as if the robot were rigid. All estimators but `wls`, `ols` and `sdp`, and
    learning, go through the logs again, in this process alone. `learn_residual` learns what the estimate misses of the torques, writes
    it beside the estimates as learned_residual.npz where cross-validation finds it worth anything, and changes nothing else; raises
    `FlexcalError` without scikit-learn, and `InputError` for a `flexible` robot.
    """
    if learn_residual:
        require_scikit_learn()
        if flexible:
            raise InputError(
                "a residual torque is learned for rigid joints, as a function of what the motors do; leave out one of --learn-residual and "
                "--flexible."
            )
    begun = time.perf_counter()
    require_distinct(logs, validate)
    bare = RobotModel.from_yaml(robot, estimates=False)
    source = bare.path.parent / bare.config.estimates
    blocks = read_estimates(source, without="dynamics") if source.exists() else {}
    model = with_blocks(bare, blocks, source)
    springs = drive_springs(model, [*logs, *validate], estimator) if flexible else ()
    treatment = treatment_of(model, logs)

    with TemporaryDirectory(prefix="flexcal_") as folder:
        scratch = Path(folder)
        read = read_logs(logs, model, treatment, scratch, jobs=jobs)
        windows = [split(log, treatment, hold_out) for log in read]
        fitted = [LogPart(log, early) for log, (early, _) in zip(read, windows, strict=True)]
        unseen = [
            LogPart(log, late) for log, (_, late) in zip(read, windows, strict=True) if late is not None
        ]
        others = read_logs(validate, model, treatment, scratch, jobs=jobs)
        require_unloaded([*read, *others], model)
        require_joint_torques([*read, *others], model)
        unseen += [LogPart(log, Window()) for log in others]

        def systems(parts: list[LogPart], observation: Observation, batches: int) -> list[ExperimentSystem]:
            return log_systems(parts, observation, treatment, batches=batches, jobs=jobs, progress=progress)

        def equations(observation: Observation) -> list[ExperimentSystem]:
            return systems(fitted, observation, batches_each(len(logs)))

        declared = model.config.dynamics.friction
        friction = select_friction(model, declared, equations, treatment.decimation)
        observation = with_play(Observation(model, friction.terms, springs), equations)
        base = BaseParameters.of(observation)
        fit = equations(observation)
        train = RegressionData.of(observation, base, fit)
        held_out = RegressionData.of(observation, base, systems(unseen, observation, 1)) if unseen else None
        recorded = _recorded(fitted, observation, base, treatment)
        estimate = ESTIMATORS[estimator](train, recorded)
        unseen_rows = _recorded(unseen, observation, base, treatment) if unseen else None
        learned = (
            LearnedDynamics.of(recorded, fit, unseen_rows, estimate, progress) if learn_residual else None
        )
        options = {
            "estimator": estimator,
            "hold_out": hold_out,
            "friction": ", ".join(friction.labels),
            "flexible": flexible,
        }
        origin = provenance([robot, bare.urdf, *logs], options, source if blocks else None, tuple(blocks))
        estimate = replace(estimate, provenance=origin)
        target = source if out is None else out / ESTIMATES
        essential = essential_parameters(train, estimate)
        seconds = time.perf_counter() - begun
        classic = (
            base if friction.terms == CLASSIC else BaseParameters.of(replace(observation, terms=CLASSIC))
        )
        result = RobotDynamics(
            estimate,
            estimator,
            classic.rank,
            train,
            held_out,
            hold_out,
            tuple(validate),
            essential,
            friction,
            observation.motors,
            treatment,
            learned,
            seconds,
            target,
        )
        store_block(source, target, blocks, "dynamics", estimate)
        if learned is not None:
            learned.store(target)
        if out is not None:
            from flexcal.report.dynamics import DynamicsStudy, write_dynamics_report

            document = result.document()
            write_results(out, document)
            borders = [math.inf if late is None else late.start for _, late in windows]
            borders += [-math.inf] * len(others)
            predictions = log_predictions(
                [*read, *others], borders, observation, estimate, treatment, progress=progress
            )
            if validate:
                files = [robot, bare.urdf, *logs, *validate]
                origin = provenance(files, options, source if blocks else None, tuple(blocks))
            study = DynamicsStudy(model.name, document, estimate, predictions, origin)
            write_dynamics_report(out / "report.html", study)
        return result


def _recorded(
    parts: Sequence[LogPart], observation: Observation, base: BaseParameters, treatment: Treatment
) -> RecordedRows:
    """The rows of parts of logs once more, log after log in this process."""
    logs, windows = [part.log for part in parts], [part.window for part in parts]
    return RecordedRows(observation, base, logs, windows, treatment.decimation, treatment.mask_standstill)
