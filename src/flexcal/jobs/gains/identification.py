"""Identification of drive gains: a robot model and its joint logs in, factors of the declared gains out."""

from __future__ import annotations

import numpy as np

from flexcal.data.tables import mapped_signals
from flexcal.dynamics.drives import drive_gains
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData, batches_each
from flexcal.dynamics.signals import Window
from flexcal.errors import InputError
from flexcal.jobs.gains.result import GainsIdentification
from flexcal.jobs.gains.split_halves import half_gains
from flexcal.jobs.inputs import require_distinct_files
from flexcal.jobs.logs import (
    JointLogs,
    LogSegment,
    assemble_log_systems,
    choose_preprocessing,
    log_files,
    model_for_logs,
    payload_masses,
    preprocessing_document,
    read_logs,
    require_no_wrenches,
    scratch_folder,
)
from flexcal.model.robot import RobotModel
from flexcal.parallel import open_workers
from flexcal.progress import Progress, silent


def identify_gains(
    model: RobotModel, logs: JointLogs, *, jobs: int = 1, progress: Progress = silent
) -> GainsIdentification:
    """Fit drive gains (N m/A) to joint logs with and without a payload of known mass.

    Of the payload its mass alone is taken as known; friction is the classic one.

    Parameters
    ----------
    model : RobotModel
        Nominal robot with the payload that robot.yaml declares.
    logs : sequence of path or Recording
        Joint logs, as files or in memory, of which each says whether the payload was held; in memory the gains that were applied
        count as 1.
    jobs : int
        Number of logs read in parallel, each in its own process.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    GainsIdentification
        Its `gains`, `estimate`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where the logs do not fit the robot, a log is given twice or does not say whether the payload was held, or a matrix of `signals:`
        mixes the torques of several columns.

    Examples
    --------
    The virtual cell, whose gains are right, moves with and without its payload:

    >>> from dataclasses import replace
    >>> import numpy as np
    >>> from flexcal import RobotModel, TrajectoryRequest, VirtualCell, design_trajectories, identify_gains
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False).without_springs()
    >>> settings = replace(model.config.dynamics, cutoff_hz=20.0, friction="classic")
    >>> model = replace(model, config=replace(model.config, dynamics=settings))
    >>> request = TrajectoryRequest(count=1, criterion="posterior", searches=1, steps=1)
    >>> plan = replace(design_trajectories(model, request).plan, periods=1, settle_periods=0, rate_hz=1000.0)
    >>> logs = []
    >>> for mass in (0.0, 6.0):
    ...     for log in VirtualCell(model).record(replace(plan, payload=mass)):
    ...         logs.append(replace(log, payload=np.full(len(log), mass)))
    >>> gains = identify_gains(model, logs)
    >>> bool(abs(gains.gains[1] - 1) < 0.05)
    True
    """
    robot = model_for_logs(model, logs)
    declared = _declared(robot)
    with scratch_folder() as folder, open_workers(None, jobs) as workers:
        files = log_files(logs, folder, "log")
        require_distinct_files(files)
        preprocessing = choose_preprocessing(robot, files, workers=workers)
        observation = Observation(robot, CLASSIC)
        read = read_logs(files, robot, preprocessing, folder, workers=workers)
        payloads = payload_masses(read, robot)
        require_no_wrenches(read)
        parts = [LogSegment(log, Window()) for log in read]
        systems = assemble_log_systems(
            parts,
            observation,
            preprocessing,
            batches=batches_each(len(files)),
            workers=workers,
            progress=progress,
        )
    base = BaseParameters.of(observation)
    return GainsIdentification(
        model=model,
        estimate=drive_gains(RegressionData.of(observation, base, systems), payloads),
        halves=half_gains(observation, base, systems, payloads),
        declared=declared,
        payloads=tuple(payloads),
        signals=preprocessing_document(preprocessing, read),
    )


def _declared(model: RobotModel) -> np.ndarray:
    """Declared gains (n,) of `signals: tau:`, one per joint."""
    config, mapped = model.config.signals.get("tau"), mapped_signals(model).get("tau")
    matrix = None if mapped is None else mapped.matrix
    if matrix is not None and (
        matrix.shape != (model.n, model.n) or np.any(matrix != np.diag(np.diag(matrix)))
    ):
        raise InputError(
            "E-RUN-032",
            f"{model.path}: the matrix of signals.tau mixes columns, but drive gains need one column per joint.",
        )
    return np.ones(model.n) if config is None or config.gain is None else np.array(config.gain)
