"""Temperature of the arm at targets, commands and measurements of a calibrated robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from flexcal.calibration.comparison import TEMPERATURE
from flexcal.data.poses import PoseSet, ToolTargets
from flexcal.errors import InputError
from flexcal.jobs.inputs.stored_model import CalibratedRobot
from flexcal.model.kinematics import at_temperature, depends_on_temperature
from flexcal.model.robot import RobotModel
from flexcal.units import temperature_fault

_Rows = TypeVar("_Rows", PoseSet, ToolTargets)
_BEYOND = 0.1
"""Share of the calibrated range by which a temperature may lie outside it."""


def with_temperature(
    robot: CalibratedRobot, rows: _Rows, given: float | None
) -> tuple[_Rows, tuple[str, ...]]:
    """Targets or measured points with their temperatures, their own or the `given` one, °C, and remarks on these.

    Raises `InputError` where both are there, and where the given one is that of no arm.
    """
    require_temperature(given)
    if rows.temperature is not None and given is not None:
        raise InputError(
            "E-RUN-109",
            "there is a column 'temperature', and --temperature; leave the option or the column out.",
        )
    temperature = rows.temperature if given is None else np.full(len(rows), float(given))
    what = "errors" if isinstance(rows, PoseSet) else "positions"
    return replace(rows, temperature=temperature), temperature_remarks(robot, temperature, what)


def held_at(robot: CalibratedRobot, temperature: float | None) -> tuple[RobotModel, tuple[str, ...]]:
    """The most probable robot at one temperature, °C, by default that at which its parameters hold, and remarks on it.

    Raises `InputError` for a temperature that no arm has.
    """
    require_temperature(temperature)
    if not depends_on_temperature(robot.model):
        warm = None if temperature is None else np.array([temperature])
        return robot.probable, temperature_remarks(robot, warm)
    reference = reference_temperature(robot.model)
    at = reference if temperature is None else temperature
    low, high = calibrated_temperatures(robot)
    said = (
        f"the arm is given as it is at {at:.1f} °C; it changes with temperature, and was calibrated from {low:.1f} to {high:.1f} °C",
    )
    outside = () if temperature is None else temperature_remarks(robot, np.array([temperature]))
    return at_temperature(robot.probable, at), (*said, *outside)


def require_temperature(given: float | None) -> None:
    """Raise `InputError` for a temperature, °C, that no arm has; None passes."""
    fault = "" if given is None else temperature_fault(given)
    if fault:
        raise InputError("E-RUN-111", f"the given temperature {fault}")


def temperature_remarks(
    robot: CalibratedRobot, temperature: np.ndarray | None, what: str = "positions"
) -> tuple[str, ...]:
    """What is to be said of temperatures (N,), °C, at which a calibrated robot is used, or of their absence."""
    model = robot.model
    if not depends_on_temperature(model):
        return () if temperature is None else (_unused(robot, temperature, what),)
    low, high = calibrated_temperatures(robot)
    if temperature is None:
        return (
            f"no temperature is given: {what} are for {reference_temperature(model):.1f} °C, and the calibration was from {low:.1f} to "
            f"{high:.1f} °C; a column 'temperature', or --temperature, says another",
        )
    slack = _BEYOND * (high - low)
    outside = (temperature < low - slack) | (temperature > high + slack)
    if not outside.any():
        return ()
    worst = float(temperature[np.argmax(np.maximum(low - temperature, temperature - high))])
    beyond = f"outside those of the calibration, {low:.1f} to {high:.1f} °C: expansion and drift are extrapolated there"
    if outside.all() and np.ptp(temperature) == 0:
        return (f"the temperature of {worst:.1f} °C lies {beyond}",)
    return (f"{outside.sum()} of {len(temperature)} temperatures, as {worst:.1f} °C, lie {beyond}",)


def kelvin_outside(robot: CalibratedRobot, temperature: np.ndarray | None) -> float | None:
    """How far the temperatures (N,), °C, at which a robot is used lie outside those of its calibration, K, at most, negative below them;
    None where either is not known, and for a robot that changes with temperature.
    """
    if depends_on_temperature(robot.model):
        return None
    measured = _measured_range(robot)
    if measured is None or temperature is None:
        return None
    above, below = float(temperature.max()) - measured[1], float(temperature.min()) - measured[0]
    return max(above, 0.0) if above >= -below else min(below, 0.0)


def _unused(robot: CalibratedRobot, temperature: np.ndarray, what: str) -> str:
    """That a calibration without a term of temperature takes none, and how far outside its own temperatures those given (N,), °C, are."""
    said = "the temperature is not used, because the calibration has no term that depends on it: "
    measured = _measured_range(robot)
    if measured is None:
        return f"{said}{what} are for the temperature at which it was measured, which is not known"
    low, high = measured
    where = f"at {low:.1f} °C" if high - low < 0.1 else f"from {low:.1f} to {high:.1f} °C"
    away = np.maximum(low - temperature, temperature - high)
    beyond, farthest = float(away.max()), float(temperature[np.argmax(away)])
    if beyond <= 0:
        return (
            f"{said}{what} are for the temperatures at which it was measured, {where}, which includes these"
        )
    given = (
        f"the given {farthest:.1f} °C"
        if np.ptp(temperature) == 0
        else f"of those given the farthest, {farthest:.1f} °C,"
    )
    return f"{said}{what} are for the temperatures at which it was measured, {where}; {given} is {beyond:.1f} K outside"


def _measured_range(robot: CalibratedRobot) -> tuple[float, float] | None:
    """Lowest and highest temperature that the calibration measured, °C; None where it measured none."""
    return robot.blocks["calibration"].ranges.get(TEMPERATURE) if "calibration" in robot.blocks else None


def calibrated_temperatures(robot: CalibratedRobot) -> tuple[float, float]:
    """Lowest and highest temperature of the calibration, °C; the reference temperature where they were not stored."""
    reference = reference_temperature(robot.model)
    return robot.blocks["calibration"].ranges.get(TEMPERATURE, (reference, reference))


def reference_temperature(model: RobotModel) -> float:
    """Temperature at which the parameters of a robot hold, °C."""
    return float(model.thermal.reference[0])
