"""Identification of actuators: a robot model and logs of commanded and measured positions in, actuator parameters out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from flexcal.actuators import Servo, fit_actuators
from flexcal.data.recordings import CommandLog
from flexcal.errors import InputError
from flexcal.jobs.actuators.result import ActuatorIdentification
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

Damping = Literal["velocity", "error"]
_EXPLAINED, _EXACT = 1.5, 0.003
"""Residuals over noise and over the tracking error, above both of which a controller that compensates gravity is tried, too."""
_BETTER = 0.7
"""Ratio of what the simulations miss below which it is taken."""


def identify_actuators(
    model: RobotModel,
    logs: Sequence[CommandLog],
    *,
    damping: Damping = "velocity",
    known_gains: bool = False,
    hold_out: float = 0.25,
    jobs: int = 1,
    progress: Progress = silent,
) -> ActuatorIdentification:
    """Fit gains, delay, friction and armature of position-controlled joints to commanded and measured positions alone.

    Where a controller that feels gravity imitates the robot badly, one that compensates it is tried, too, and taken if it does better.

    Parameters
    ----------
    model : RobotModel
        The robot; its links' inertials and its gravity are what all torques are relative to.
    logs : sequence of CommandLog
        Commanded and measured joint positions, as of `read_command_log`.
    damping : {"velocity", "error"}
        Whether the controller damps the velocity, or its difference from the commanded one.
    known_gains : bool
        Whether the gains are those that robot.yaml has under `controller:`.
    hold_out : float
        Last share of the windows of every log that is simulated without having been fitted.
    jobs : int
        Number of simulations at a time.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    ActuatorIdentification
        Its `estimate`, `actuators`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where the logs are too short or a joint does not move, the robot's motors are coupled or drive loops, or `known_gains` is asked
        for without any in robot.yaml.

    Examples
    --------
    >>> from flexcal import RobotModel, identify_actuators, read_command_log
    >>> model = RobotModel.from_yaml("examples/servo_arm/robot.yaml", estimates=False)
    >>> found = identify_actuators(model, [read_command_log("examples/servo_arm/moves.csv", model)])
    >>> low, high = found.estimate.interval("elbow.actuator.stiffness")
    >>> bool(low < 300 < high)
    True
    """
    model.require_motors("the identification of actuators")
    servo = _servo(model, damping, known_gains)
    fit = fit_actuators(model, logs, servo, hold_out=hold_out, threads=jobs, progress=progress)
    if ((fit.fitted.simulated > _EXPLAINED * fit.noise) & (fit.fitted.share > _EXACT)).any():
        balanced = replace(servo, compensates_gravity=True)
        other = fit_actuators(
            model,
            logs,
            balanced,
            hold_out=hold_out,
            threads=jobs,
            progress=lambda stage, share: progress(f"{stage} with compensated gravity", share),
        )
        if other.fitted.share.max() < _BETTER * fit.fitted.share.max():
            servo, fit = balanced, other
    return ActuatorIdentification(
        model=model,
        estimate=fit.estimate,
        fit=fit,
        servo=servo,
        logs=tuple(log.name for log in logs),
        seconds=sum(log.duration for log in logs),
    )


def _servo(model: RobotModel, damping: Damping, known_gains: bool) -> Servo:
    if not known_gains:
        return Servo(damping == "error")
    controller = model.config.controller
    if controller is None or min(controller.kp, default=0.0) <= 0:
        raise InputError(
            "E-RUN-106",
            f"{model.path} has no gains; give positive kp, and kd, under `controller:`, or leave --known-gains out.",
        )
    return Servo(damping == "error", controller.kp, controller.kd)
