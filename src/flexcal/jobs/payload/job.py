"""Identification of a payload's mass, centre of mass and inertia, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.payload import PayloadFit, identify_payload, uncertain_parameters
from flexcal.dynamics.signals import JointLog, log_blocks
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, provenance, read_estimates, sha256_of
from flexcal.jobs.inputs import require_distinct_files, stored_estimates
from flexcal.jobs.logs import (
    Preprocessing,
    choose_preprocessing,
    preprocessing_document,
    read_logs,
    require_joint_torques,
    require_no_wrenches,
    scratch_folder,
    weight_faults,
)
from flexcal.jobs.payload.equations import PayloadLogEquations
from flexcal.jobs.payload.planned_recordings import PlannedLogs, with_planned_torque
from flexcal.jobs.payload.remarks import declared_payload, other_payloads, payload_remarks
from flexcal.jobs.result_files import (
    estimates_target,
    header,
    quantities,
    store_block,
    write_predictions,
    write_results,
)
from flexcal.model.robot import PAYLOAD_FRAME, RobotModel, last_frame, torque_units, with_blocks, with_payload
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, payload_checks

_ROUGH = 2
"""Fits of an elastic robot before the last one, each with the springs loaded by the payload of the one before."""
_ROWS_HZ = 6.0
"""Rows a second of an elastic robot, at most: its springs yield as `FlexibilityCorrection` has it only well below the first resonance."""
_SENSELESS = 0.5
"""Share of the torques that no robot misses whose torques they are."""


@dataclass(frozen=True, eq=False)
class RobotPayload:
    """The `fit` of the recordings `loaded` and `free`, the `model` with it, the robot's other `blocks`, and where the estimate was written.

    `declared` is the robot of robot.yaml alone, `signals` are as `preprocessing_document` has them, `command` the command line, where
    there was one.
    """

    declared: RobotModel
    model: RobotModel
    frame: str
    fit: PayloadFit
    blocks: Mapping[Block, Estimate]
    signals: Mapping[str, Any]
    loaded: tuple[Path, ...]
    free: tuple[Path, ...]
    estimates: Path
    command: str = ""
    weight_faults: tuple[str, ...] = ()

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(payload_checks(self._numbers))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("payload"), **self._numbers, "verdict": self.trust.document()}

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        """Everything but the verdict; `declaration` is the line of robot.yaml that says the same."""
        fit, payload = self.fit, self.declared.payload
        joints = self.declared.joint_names
        return {
            "robot": self.declared.name,
            "frame": self.frame,
            "recordings": {"loaded": list(self.loaded), "free": list(self.free)},
            "parameters": quantities(fit.estimate),
            "declared": None if payload is None else declared_payload(payload),
            "declaration": self.declaration,
            "error_percent": {
                "train": 100 * fit.error,
                "best": 100 * fit.own_error,
                "per_joint": dict(zip(joints, 100 * fit.joint_errors, strict=True)),
            },
            "torque_units": torque_units(self.declared),
            "robot_mass_kg": float(self.declared.links.mass.sum()),
            "body_rise": fit.rise,
            "other_payloads": other_payloads(fit.estimate, self.blocks),
            "signals": dict(self.signals),
            "weight_faults": list(self.weight_faults),
            "remarks": list(payload_remarks(fit, self.declared, self.blocks)),
            "estimates": self.estimates,
            "provenance": dict(fit.estimate.provenance),
            "command": self.command,
        }

    @property
    def declaration(self) -> str:
        """`payload:` of robot.yaml with what was found."""
        estimate = self.fit.estimate
        values = estimate.values
        com = ", ".join(f"{values[f'payload.com_{key}']:.5g}" for key in "xyz")
        text = f"frame: {self.frame}, mass: {values['payload.mass']:.5g}, com: [{com}], mass_std: {estimate.std('payload.mass'):.2g}"
        if estimate.identifiable[estimate.parameters.index("payload.Ixx")]:
            payload = self.model.payload
            assert payload is not None
            rows = ", ".join(f"[{', '.join(f'{entry:.4g}' for entry in row)}]" for row in payload.inertia)
            text += f", inertia: [{rows}]"
        return f"payload: {{{text}}}"


def identify_robot_payload(
    robot: Path,
    logs: Sequence[Path],
    *,
    free: Sequence[Path] = (),
    frame: str = "",
    estimates: Path | None = None,
    accept_weight: bool = False,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    progress: Progress = silent,
) -> RobotPayload:
    """Find what the robot of a robot.yaml holds in `logs`, and store the block `payload`.

    `logs` and `free` are files, or folders of trajectories as 'measure' leaves them. Of the robot itself its estimates tell, all blocks
    but that of the payload, or the logs `free` without payload, or both together. The values are in the frame that robot.yaml declares
    for the payload, else in the URDF frame `frame`, else in that of the last link. `estimates` is read (and written) in place of those
    beside robot.yaml: a file, or the folder that another identification wrote. Torques unlike the links' weight are refused, unless they
    are to be accepted (`accept_weight`), with a remark. With `out`, estimates, results.json, predictions.npz
    and report.html go to that folder. Raises `FlexcalError` where neither tells of the robot's dynamics, a log does not fit the robot,
    says that it holds nothing (or something, of those that are free), is given twice or in the block `dynamics` already, and as
    `identify_payload` does; nothing is written then.
    """
    loaded, unloaded = PlannedLogs.of(logs), PlannedLogs.of(free)
    _require_plans(loaded, unloaded)
    every = [*loaded.files, *unloaded.files]
    require_distinct_files(every)
    nominal = with_planned_torque(
        RobotModel.from_yaml(robot, estimates=False), [*loaded.plans, *unloaded.plans]
    )
    bare, frame = _held(nominal, frame)
    source = stored_estimates(bare, estimates)
    if estimates is not None and not source.exists():
        raise InputError(
            "E-RUN-063", f"{source} does not exist; give the estimates.yaml of 'flexcal identify dynamics'."
        )
    blocks = read_estimates(source, without="payload") if source.exists() else {}
    target = estimates_target(source, out, "payload")
    if "dynamics" not in blocks and not free:
        raise InputError(
            "E-RUN-064",
            f"{source} has no block 'dynamics', so payload and robot inertia are not identifiable separately; run 'flexcal identify "
            f"dynamics {robot} "
            "LOGS…' on recordings without payload first, give its folder with --estimates, or such recordings with --free.",
        )
    _require_news(every, blocks)
    model = with_blocks(bare, blocks, source)
    if "dynamics" in blocks:
        model = model.with_estimate(
            blocks["dynamics"]
        )  # later blocks keep no covariance of links with drives
    carries = [True] * len(loaded.files) + [False] * len(unloaded.files)
    treatment = _slow(
        choose_preprocessing(model, every, flexible=bool(model.elastic), loaded=carries), model, every
    )
    with scratch_folder() as folder:
        read = read_logs(every, model, treatment, folder, jobs=jobs)
        _require_payloads(read, carries)
        require_no_wrenches(read)
        faults = tuple(weight_faults(read, model))
        if not accept_weight:
            require_joint_torques(read, model)
        known = blocks.get("dynamics")
        for number in range(_ROUGH if model.elastic else 0):
            progress("payload", number / (_ROUGH + 1))
            rough = identify_payload(
                PayloadLogEquations.of(model, read, carries, known, (), treatment).equations
            )
            model = model.with_values(rough.estimate.values)
        progress("payload", _ROUGH / (_ROUGH + 1))
        system = PayloadLogEquations.of(model, read, carries, known, uncertain_parameters(model), treatment)
        fit = identify_payload(system.equations)
        model = model.with_values(fit.estimate.values)
        predictions = [] if out is None else system.predictions(fit)
        progress("payload", 1.0)
    if fit.error > _SENSELESS:
        raise InputError(
            "E-RUN-065",
            f"{every[0]}: the relative torque error of the fit is {100 * fit.error:.0f} %, so the torques are not those of this robot in "
            f"N m; check "
            "robot.yaml, and signs, units and gear ratios under `signals:`.",
        )
    origin = provenance(
        [robot, bare.urdf, *loaded.plan_files, *unloaded.plan_files, *every],
        {"loaded": len(loaded.files), "free": len(unloaded.files)},
        source if blocks else None,
        tuple(blocks),
    )
    estimate = replace(fit.estimate, provenance=origin | {PAYLOAD_FRAME: frame})
    result = RobotPayload(
        declared=nominal,
        model=model,
        frame=frame,
        fit=replace(fit, estimate=estimate),
        blocks=blocks,
        signals=preprocessing_document(treatment, read),
        loaded=loaded.files,
        free=unloaded.files,
        estimates=target,
        command=command,
        weight_faults=faults,
    )
    store_block(source, target, blocks, "payload", estimate)
    if out is not None:
        from flexcal.jobs.pages import report_folder

        write_results(out, result.document())
        write_predictions(out, predictions)
        report_folder(out)
    return result


def _held(model: RobotModel, frame: str) -> tuple[RobotModel, str]:
    """The robot with a payload in its frame, and that frame."""
    declared = model.payload
    if declared is None:
        place = frame or last_frame(model)
        return with_payload(model, place, 1.0, np.zeros(3), np.zeros((3, 3))), place
    if frame not in ("", declared.frame):
        raise InputError(
            "E-RUN-066",
            f"--frame is '{frame}', but {model.path} declares the payload in '{declared.frame}'; leave --frame out, or correct robot.yaml.",
        )
    return model, declared.frame


def _slow(treatment: Preprocessing, model: RobotModel, logs: Sequence[Path]) -> Preprocessing:
    """With rows no closer than springs allow."""
    if not model.elastic:
        return treatment
    rate = min(1.0 / next(log_blocks(log, model)).time_step for log in logs)
    slowest = Decimation.near(rate / _ROWS_HZ)
    if treatment.decimation.factor >= slowest.factor:
        return treatment
    chosen = tuple(dict.fromkeys((*treatment.proposed, "decimation")))
    return replace(treatment, decimation=slowest, proposed=chosen)


def _require_news(logs: Sequence[Path], blocks: Mapping[Block, Estimate]) -> None:
    """Raises `InputError` for a log that the block `dynamics` was made from: it would count twice."""
    if "dynamics" not in blocks:
        return
    used = {digest for key, digest in blocks["dynamics"].provenance.items() if key.startswith("input.")}
    for log in logs:
        if sha256_of(log) in used:
            raise InputError(
                "E-RUN-067",
                f"{log}: the block 'dynamics' was identified from this recording, which would be used twice; leave it "
                "out, or give another.",
            )


def _require_plans(loaded: PlannedLogs, free: PlannedLogs) -> None:
    """Raises `InputError` for trajectories that were planned otherwise than they are given here."""
    if any(plan.payload == 0 for plan in loaded.plans):
        raise InputError(
            "E-RUN-068",
            "a folder among LOGS was planned without the payload; give it with --free, or design it with --loaded.",
        )
    if any(plan.payload != 0 for plan in free.plans):
        raise InputError(
            "E-RUN-069", "a folder under --free was planned with the payload; give it among LOGS."
        )


def _require_payloads(logs: Sequence[JointLog], loaded: Sequence[bool]) -> None:
    for log, carrying in zip(logs, loaded, strict=True):
        if carrying and log.payload == 0:
            raise InputError(
                "E-RUN-070",
                f"{log.path}: its column 'payload' states that the robot held no payload; give it with --free, or correct the column.",
            )
        if not carrying and log.payload is not None and log.payload > 0:
            raise InputError(
                "E-RUN-071",
                f"{log.path}: recorded with a payload of {log.payload:g} kg, but --free takes recordings without.",
            )
