"""Recordings of motors that LeRobot calibrated, as joint positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError
from flexcal.export import Readings, joint_motors, read_motor_calibrations

_COLUMNS = ("{}", "{}.pos", "observation.state.{}.pos", "observation.state.{}", "{}_ticks")
"""Names of a motor's column."""


@dataclass(frozen=True)
class MotorReadings:
    """LeRobot's `calibration` file, motors of joints with other names (as `joint_motors` takes them), and what was recorded of them."""

    calibration: Path
    motors: tuple[str, ...] = ()
    readings: Readings = "ticks"

    def mapped(self, file: Path, columns: Sequence[str], joints: Sequence[str]) -> tuple[str, ...]:
        """Entries of --map for the joint positions; raises `InputError` where a motor has no column, and as `joint_motors` does."""
        known = read_motor_calibrations(self.calibration)
        entries = []
        for k, joint in enumerate(joint_motors(self.calibration, known, joints, self.motors), 1):
            names = [pattern.format(joint.motor.name) for pattern in _COLUMNS]
            column = next((name for name in names if name in columns), None)
            if column is None:
                raise InputError(
                    "E-ROS-031",
                    f"{file} has no column {names[0]} or {names[1]} of that motor; it has {', '.join(columns)}.",
                )
            gain, offset = joint.scale_and_shift(self.readings)
            entries.append(f"q{k}={gain:.17g}*{column}[rad]{offset:+.15f}")
        return tuple(entries)
