"""Identification of a payload: a robot model and its joint logs in, an estimate with its predictions out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.payload import fit_payload, uncertain_parameters
from flexcal.dynamics.signals import JointLog, log_blocks
from flexcal.errors import FlexcalError, InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import sha256_of
from flexcal.jobs.inputs import require_distinct_files
from flexcal.jobs.logs import (
    JointLogs,
    Preprocessing,
    choose_preprocessing,
    log_files,
    log_names,
    model_for_logs,
    preprocessing_document,
    read_logs,
    require_joint_torques,
    require_no_wrenches,
    scratch_folder,
    weight_faults,
)
from flexcal.jobs.payload.equations import PayloadLogEquations
from flexcal.jobs.payload.result import PayloadIdentification
from flexcal.model.robot import PAYLOAD_FRAME, RobotModel, last_frame, with_payload
from flexcal.parallel import open_workers
from flexcal.progress import Progress, silent

_ROUGH = 2
"""Number of fits of an elastic robot before the last one, each with the springs loaded by the previous payload."""
_ROWS_HZ = 6.0
"""Largest row rate of an elastic robot: `FlexibilityCorrection` holds only well below the first resonance."""
_SENSELESS = 0.5
"""Relative torque error from which the torques must be of another robot or unit."""


def identify_payload(
    model: RobotModel,
    logs: JointLogs,
    *,
    dynamics: Estimate | None = None,
    free: JointLogs = (),
    frame: str = "",
    accept_weight: bool = False,
    jobs: int = 1,
    progress: Progress = silent,
) -> PayloadIdentification:
    """Fit mass, centre of mass and inertia of a payload to joint logs of the robot that holds it.

    The robot's own dynamics are known from an estimate, from logs without the payload, or from both.

    Parameters
    ----------
    model : RobotModel
        Robot, with its estimates of springs and geometry where there are any (`RobotModel.with_estimate`).
    logs : sequence of path or Recording
        Joint logs with the payload, as files or in memory, there in SI units of the joints.
    dynamics : Estimate, optional
        The robot's own dynamics, as `identify_dynamics` estimates them from logs without the payload. Its values and covariance
        replace those that the model has of the same parameters. Required without `free`.
    free : sequence of path or Recording
        Joint logs without the payload.
    frame : str
        URDF frame of the values, by default that of the last link; where robot.yaml declares a payload, it is that of the
        declaration.
    accept_weight : bool
        Whether torques unlike the links' weight are accepted, with a remark.
    jobs : int
        Number of logs read in parallel, each in its own process.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    PayloadIdentification
        Its `estimate`, `model`, `residuals`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where neither `dynamics` nor `free` are given, a log does not fit the robot, states that it was recorded without the payload (or
        with it, of those that are free), is given twice or was used for `dynamics` already; and where the 95 % interval of the mass
        contains zero.

    Examples
    --------
    The virtual cell moves without and with 6 kg:

    >>> from dataclasses import replace
    >>> from flexcal import RobotModel, TrajectoryRequest, VirtualCell, design_trajectories, identify_payload
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False).without_springs()
    >>> settings = replace(model.config.dynamics, cutoff_hz=20.0, friction="classic")
    >>> model = replace(model, config=replace(model.config, dynamics=settings))
    >>> request = TrajectoryRequest(count=1, criterion="posterior", searches=1, steps=1)
    >>> plan = replace(design_trajectories(model, request).plan, periods=1, settle_periods=0, rate_hz=1000.0)
    >>> cell = VirtualCell(model)
    >>> free, loaded = (list(cell.record(replace(plan, payload=mass))) for mass in (0.0, 6.0))
    >>> print(f"{identify_payload(model, loaded, free=free).estimate.values['payload.mass']:.1f} kg")
    6.0 kg
    """
    if dynamics is None and not free:
        raise FlexcalError(
            "E-RUN-094",
            "payload and robot inertia are not identifiable separately; give the estimate of the robot's own dynamics (`dynamics`) or "
            "logs without payload (`free`).",
        )
    start, frame = attach_payload(model, frame)
    if dynamics is not None and not _has(start, dynamics):
        start = start.with_estimate(dynamics)
    robot = model_for_logs(start, [*logs, *free])
    if dynamics is not None:
        robot = robot.with_estimate(dynamics)  # later estimates keep no covariance of links with drives
    with scratch_folder() as folder:
        loaded, unloaded = log_files(logs, folder, "log"), log_files(free, folder, "free")
        files = [*loaded, *unloaded]
        require_distinct_files(files)
        _require_unused(files, dynamics)
        carrying = [True] * len(loaded) + [False] * len(unloaded)
        preprocessing = choose_preprocessing(robot, files, flexible=bool(robot.elastic), loaded=carrying)
        preprocessing = _slow(preprocessing, robot, files)
        with open_workers(None, jobs) as workers:
            read = read_logs(files, robot, preprocessing, folder, workers=workers)
        _require_payloads(read, carrying)
        require_no_wrenches(read)
        faults = tuple(weight_faults(read, robot))
        if not accept_weight:
            require_joint_torques(read, robot)
        for number in range(_ROUGH if robot.elastic else 0):
            progress("payload", number / (_ROUGH + 1))
            rough = PayloadLogEquations.of(robot, read, carrying, dynamics, (), preprocessing)
            robot = robot.with_values(fit_payload(rough.equations).estimate.values)
        progress("payload", _ROUGH / (_ROUGH + 1))
        system = PayloadLogEquations.of(
            robot, read, carrying, dynamics, uncertain_parameters(robot), preprocessing
        )
        fit = fit_payload(system.equations)
        if fit.error > _SENSELESS:
            raise InputError(
                "E-RUN-065",
                f"{files[0]}: the relative torque error of the fit is {100 * fit.error:.0f} %, so the torques are not those of this robot "
                "in N m; check robot.yaml, and signs, units and gear ratios under `signals:`.",
            )
        predictions = tuple(system.predictions(fit))
        progress("payload", 1.0)
        estimate = replace(fit.estimate, provenance={PAYLOAD_FRAME: frame})
        return PayloadIdentification(
            model=start.with_estimate(estimate),
            estimate=estimate,
            declared=model,
            frame=frame,
            fit=fit,
            predictions=predictions,
            loaded=log_names(loaded, folder),
            free=log_names(unloaded, folder),
            signals=preprocessing_document(preprocessing, read),
            weight_faults=faults,
        )


def attach_payload(model: RobotModel, frame: str) -> tuple[RobotModel, str]:
    """Robot with a payload in its frame, and that frame."""
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


def _has(model: RobotModel, estimate: Estimate) -> bool:
    """Whether the model already has all robot parameters of an estimate."""
    own = set(estimate.parameters.names) & set(model.values)
    return own <= set(model.posterior.parameters.names)


def _slow(preprocessing: Preprocessing, model: RobotModel, logs: Sequence[Path]) -> Preprocessing:
    """Preprocessing with a row rate that the springs allow."""
    if not model.elastic:
        return preprocessing
    rate = min(1.0 / next(log_blocks(log, model)).time_step for log in logs)
    slowest = Decimation.near(rate / _ROWS_HZ)
    if preprocessing.decimation.factor >= slowest.factor:
        return preprocessing
    chosen = tuple(dict.fromkeys((*preprocessing.proposed, "decimation")))
    return replace(preprocessing, decimation=slowest, proposed=chosen)


def _require_unused(logs: Sequence[Path], dynamics: Estimate | None) -> None:
    """Raise `InputError` for a log used in the identification of the robot's `dynamics`: it would count twice."""
    if dynamics is None:
        return
    used = {digest for key, digest in dynamics.provenance.items() if key.startswith("input.")}
    for log in logs:
        if sha256_of(log) in used:
            raise InputError(
                "E-RUN-067",
                f"{log}: the block 'dynamics' was identified from this recording, which would be used twice; leave it "
                "out, or give another.",
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
