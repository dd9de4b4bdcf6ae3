"""LeRobot's calibration of motors, a JSON file, and joint positions by it.

LeRobot reads ticks t of a motor within its recorded range as degrees (t - (range_min + range_max) / 2) · 360 / 4095: the middle of the
range is its zero, and a turn has one tick less than the motor's 4096. So a zero is corrected by the range alone.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from flexcal.errors import InputError, unreadable
from flexcal.files.formats import parse_json
from flexcal.files.transaction import MEGABYTE, read_bytes

TICKS = 4096
"""Ticks of a motor's turn."""
Readings = Literal["ticks", "degrees", "percent"]
_KEYS = ("id", "drive_mode", "homing_offset", "range_min", "range_max")
_LEAST_RANGE = 100
"""Shortest range, ticks, that is of use."""
_JOINT = re.compile(r"(-?)([^+]*?)(?:([+-]\d+(?:\.\d*)?))?$")


@dataclass(frozen=True)
class MotorCalibration:
    """Calibration of one motor, in ticks; `line` is its place in the file."""

    name: str
    line: int
    id: int
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int

    @property
    def middle(self) -> float:
        """Tick that LeRobot reads as zero."""
        return (self.range_min + self.range_max) / 2


@dataclass(frozen=True)
class JointMotor:
    """Motor of a joint: position = `sign` · (ticks - middle) · 2π / 4096 + `zero`, rad."""

    joint: str
    motor: MotorCalibration
    sign: int = 1
    zero: float = 0.0

    def scale_and_shift(self, readings: Readings) -> tuple[float, float]:
        """Gain (rad) and offset (rad) that make the joint's position of what was recorded of its motor."""
        turn = self.sign * 2 * math.pi / TICKS
        if readings == "ticks":
            return turn, self.zero - turn * self.motor.middle
        if readings == "degrees":
            return turn * (TICKS - 1) / 360, self.zero
        half = (self.motor.range_max - self.motor.range_min) / 200
        return turn * half * (-1 if self.motor.drive_mode else 1), self.zero

    def offset_to(self, other: MotorCalibration) -> float:
        """What another calibration of the motor adds to the joint's position, rad."""
        return self.sign * (self.motor.middle - other.middle) * 2 * math.pi / TICKS

    def corrected(self, offset: float) -> MotorCalibration:
        """Calibration by which the joint stands at its former position + `offset` (rad): the longest range about the other middle.

        No tick outside of the range before is in it, so that the motor goes nowhere new. Raises `InputError` where hardly a range is left.
        """
        old = self.motor
        twice = round(2 * (old.middle - self.sign * offset * TICKS / (2 * math.pi)))
        low, high = (
            (old.range_min, twice - old.range_min)
            if twice <= 2 * old.middle
            else (twice - old.range_max, old.range_max)
        )
        if high - low < _LEAST_RANGE:
            raise InputError(
                "E-ROS-019",
                f"the zero of '{self.joint}' is {math.degrees(offset):.1f}° off, at an end of the range of its motor, where LeRobot's file "
                "cannot have it; move the horn on the motor, or record the range again.",
            )
        return replace(old, range_min=low, range_max=high)


def read_motor_calibrations(path: Path) -> dict[str, MotorCalibration]:
    """Motors of a LeRobot calibration file by name; raises `InputError` with the line where it is none."""
    text = _text(path)
    document = parse_json(path, text, "correct it")
    if (
        not isinstance(document, dict)
        or not document
        or not all(isinstance(v, dict) for v in document.values())
    ):
        raise InputError(
            "E-ROS-021",
            f"{path}: this is no calibration of LeRobot, in which every motor has {', '.join(_KEYS)}; name the file of the arm, or make "
            "one with lerobot-calibrate.",
        )
    motors = {}
    for name, entry in document.items():
        line = text[: _block(text, name)[0]].count("\n") + 1
        for key in _KEYS:
            if not isinstance(entry.get(key), int) or isinstance(entry.get(key), bool):
                raise InputError(
                    "E-ROS-022",
                    f"{path} line {line}: '{name}' has no whole number '{key}'; calibrate it again.",
                )
        motor = MotorCalibration(name, line, *(entry[key] for key in _KEYS))
        if not motor.range_min < motor.range_max:
            raise InputError(
                "E-ROS-023",
                f"{path} line {line}: the range of '{name}', {motor.range_min} to {motor.range_max}, is empty; calibrate it again.",
            )
        motors[name] = motor
    return motors


def joint_motors(
    path: Path, motors: Mapping[str, MotorCalibration], joints: Sequence[str], given: Sequence[str]
) -> tuple[JointMotor, ...]:
    """Motor of every joint: that of its name, or as `given`, JOINT=MOTOR with a minus before it and degrees at zero after it.

    Raises `InputError` for joints without a motor, and what is not of that form.
    """
    said: dict[str, JointMotor] = {}
    for entry in given:
        joint, equals, source = (part.strip() for part in entry.partition("="))
        found = _JOINT.match(source)
        assert found is not None
        minus, name, degrees = found.groups()
        if not equals or joint not in joints or name not in motors:
            raise InputError(
                "E-ROS-024",
                f"--motors {entry}: it is written JOINT=MOTOR or JOINT=-MOTOR+90, with joints {', '.join(joints)} and motors "
                f"{', '.join(motors)} of {path}.",
            )
        said[joint] = JointMotor(joint, motors[name], -1 if minus else 1, math.radians(float(degrees or 0)))
    missing = [joint for joint in joints if joint not in said and joint not in motors]
    if missing:
        raise InputError(
            "E-ROS-025",
            f"{path} has no motor for {', '.join(missing)}; say which with --motors {missing[0]}=MOTOR (it has {', '.join(motors)}).",
        )
    return tuple(said.get(joint) or JointMotor(joint, motors[joint]) for joint in joints)


def corrected_file(path: Path, motors: Sequence[MotorCalibration]) -> str:
    """Text of the calibration file with the ranges of `motors`; every other character as it was."""
    text = _text(path)
    for motor in motors:
        for key in ("range_min", "range_max"):
            first, end = _block(text, motor.name)
            found = re.compile(rf'("{key}"\s*:\s*)-?\d+').search(text, first, end)
            assert found is not None
            text = text[: found.end(1)] + str(getattr(motor, key)) + text[found.end() :]
    return text


def _block(text: str, name: str) -> tuple[int, int]:
    """Where the object of a motor begins and ends."""
    found = re.compile(re.escape(json.dumps(name)) + r"\s*:\s*\{").search(text)
    first = 0 if found is None else found.start()
    return first, text.find("}", first)


def _text(path: Path) -> str:
    try:
        return read_bytes(path, limit=MEGABYTE).decode("utf-8")
    except OSError as problem:
        raise unreadable(path, problem) from problem
    except UnicodeDecodeError:
        raise InputError(
            "E-ROS-026", f"{path}: this is not UTF-8; name the JSON file of the arm's calibration."
        ) from None
