"""Identified actuators of a robot for the files of simulators."""

from __future__ import annotations

from flexcal.errors import InputError
from flexcal.export import TIME_STEP, Actuators, RenderedModel, render_isaac
from flexcal.jobs.inputs import CalibratedRobot
from flexcal.printable import quoted


def identified_actuators(robot: CalibratedRobot) -> Actuators | None:
    """Identified actuators, where there are some."""
    estimate = robot.blocks.get("actuators")
    return None if estimate is None else Actuators.of(robot.nominal, estimate)


def actuator_remarks(robot: CalibratedRobot, format: str) -> tuple[str, ...]:
    """What stands in a file of actuators without having been determined, and that these were identified on rigid links."""
    estimate = robot.blocks.get("actuators")
    if estimate is None or format not in ("mjcf", "isaac"):
        return ()
    told = zip(estimate.parameters.names, estimate.identifiable, strict=True)
    open_ = [name.replace(".actuator.", ".") for name, known in told if not known]
    remarks = []
    if open_:
        remarks.append(
            f"The logs do not tell {', '.join(open_)}: these have values of the fit, with which the motion is right and torques are not."
        )
    if format == "isaac" and Actuators.of(robot.nominal, estimate).compensates_gravity:
        remarks.append(
            "The controller compensates gravity, which is no number of an actuator: set disable_gravity of the robot's links."
        )
    if format == "mjcf" and robot.model.elastic:
        remarks.append("The actuators were identified on rigid links, and here they move elastic ones.")
    return tuple(remarks)


def rendered_actuators(robot: CalibratedRobot, time_step: float | None) -> RenderedModel:
    """The actuators as `render_isaac`; raises `InputError` where none were identified."""
    actuators = identified_actuators(robot)
    if actuators is None:
        raise InputError(
            "E-RUN-107",
            f"no actuators of {robot.nominal.path} are identified; run 'flexcal identify actuators "
            f"{quoted(robot.nominal.path)} LOGS…' first.",
        )
    return render_isaac(robot.nominal, actuators, time_step=TIME_STEP if time_step is None else time_step)
