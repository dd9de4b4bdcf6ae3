"""Answers about a calibrated robot to lines of JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.dynamics.torque_model import TorqueModel
from flexcal.errors import FlexcalError
from flexcal.export import render_runtime
from flexcal.jobs.inputs import CalibratedRobot, beyond_calibration, held_at
from flexcal.kernels import RuntimeRobot
from flexcal.model.parts import rotation_wxyz, wxyz_rotation

DONE = "done"
_KEYS = ("id", "do", "q", "dq", "ddq", "near", "position", "quaternion_wxyz", "point", "payload")
_LARGEST = {
    "q": 1e5,
    "dq": 1e5,
    "ddq": 1e7,
    "near": 1e5,
    "position": 1e5,
    "quaternion_wxyz": 2.0,
    "payload": 1e6,
}
"""Sizes beyond any robot's, in SI units: 16 000 turns of a joint, 16 000 in a second, 1000 t."""


class _UnclearError(Exception):
    """A request that cannot be answered, with the sentence that says why."""


class Answers:
    """Answers of one robot at one temperature, °C: a JSON object in a line for every line, and never an exception.

    `remarks` say what the temperature has to do with it.
    """

    def __init__(self, robot: CalibratedRobot, temperature: float | None = None) -> None:
        model, self.remarks = held_at(robot, temperature)
        drives = TorqueModel.of_blocks(model, robot.blocks).document()
        self._robot = RuntimeRobot.read(render_runtime(model, robot.with_points, drives).text)
        self._joints, self._points = self._robot.joint_names, self._robot.point_names
        self._calibrated, self._name = robot, robot.nominal.name
        self._free = np.zeros((0, len(self._joints)))
        self._verbs: dict[str, Callable[[Mapping[str, Any]], dict[str, Any]]] = {
            "compensate": self._compensate,
            "inverse": self._inverse,
            "forward": self._forward,
            "nominal": self._nominal,
            "torque": self._torque,
            "extent": self._extent,
            "describe": self._describe,
        }

    @classmethod
    def from_yaml(
        cls, robot_file: Path, estimates: Path | None = None, temperature: float | None = None
    ) -> Answers:
        """Answers of the robot of a robot.yaml; raises `FlexcalError` as reading does, and for a robot whose joints follow others."""
        return cls(CalibratedRobot.from_yaml(robot_file, estimates), temperature)

    def of(self, line: bytes) -> bytes:
        """Answer to a line, with its `id` where it has one, and a line feed at its end."""
        answer: dict[str, Any] = {}
        try:
            asked = _parsed(line)
            answer |= _identity(asked)
            verb = asked.get("do", "compensate")
            unknown = [key for key in asked if key not in _KEYS]
            if unknown:
                raise _UnclearError(f"'{unknown[0]}' is unknown; there are {', '.join(_KEYS)}")
            if not isinstance(verb, str) or verb not in self._verbs:
                raise _UnclearError(f"'do' must be one of {', '.join(self._verbs)}")
            answer |= self._verbs[verb](asked)
        except (_UnclearError, FlexcalError) as problem:
            answer |= {"status": str(problem)}
        return json.dumps(answer, allow_nan=False).encode() + b"\n"

    def _compensate(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        found = self._robot.compensate(self._positions(asked, "q"), self._point(asked), _payload(asked))
        return self._commanded(*found)

    def _inverse(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        position, rotation = _pose(asked)
        near = self._positions(asked, "near")
        found = self._robot.inverse(position, rotation, near, self._point(asked), _payload(asked))
        return self._commanded(*found)

    def _commanded(self, command: np.ndarray, status: np.ndarray, joint: np.ndarray) -> dict[str, Any]:
        if status[0] == 0:
            return {"status": DONE, "command": command[0].tolist()}
        said = RuntimeRobot.describe(int(status[0]))
        return {"status": said, **({} if joint[0] < 0 else {"joint": self._joints[int(joint[0])]})}

    def _forward(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        found = self._robot.forward(
            self._positions(asked, "q"), self._point(asked), _payload(asked), self._free
        )
        position, rotation, status = found
        if status[0] != 0:
            return {"status": RuntimeRobot.describe(int(status[0]))}
        return _placed(position[0], rotation[0])

    def _nominal(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        position, rotation = self._robot.nominal(self._positions(asked, "q"), self._point(asked))
        return _placed(position[0], rotation[0])

    def _torque(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        q, dq, ddq = (self._positions(asked, key) for key in ("q", "dq", "ddq"))
        torque, status, _ = self._robot.torque(q, dq, ddq, _payload(asked))
        if status[0] != 0:
            return {"status": RuntimeRobot.describe(int(status[0]))}
        return {"status": DONE, "torque": torque[0].tolist()}

    def _extent(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        point = np.array([self._points[self._point(asked)]])
        beyond = beyond_calibration(self._calibrated, self._positions(asked, "q"), point)
        return {"status": DONE, "beyond": float(beyond[0])}

    def _describe(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        return {"status": DONE, "robot": self._name, "joints": self._joints, "points": self._points}

    def _positions(self, asked: Mapping[str, Any], key: str) -> np.ndarray:
        return _numbers(asked, key, len(self._joints))[None]

    def _point(self, asked: Mapping[str, Any]) -> int:
        name = asked.get("point", self._points[0])
        if name not in self._points:
            raise _UnclearError(f"'point' must be one of {', '.join(self._points)}")
        return self._points.index(name)


def _parsed(line: bytes) -> dict[str, Any]:
    try:
        asked = json.loads(line)
    except (ValueError, RecursionError):
        raise _UnclearError("the line is no JSON document") from None
    if not isinstance(asked, dict):
        raise _UnclearError('the line is no JSON object, such as {"q": [0, 0, 0, 0, 0, 0]}')
    return asked


def _identity(asked: Mapping[str, Any]) -> dict[str, Any]:
    """The `id` of a request that comes back with its answer."""
    number = asked.get("id")
    if number is None:
        return {}
    if not isinstance(number, str | int | float) or (isinstance(number, float) and not math.isfinite(number)):
        raise _UnclearError("'id' must be a text or a finite number")
    return {"id": number}


def _numbers(asked: Mapping[str, Any], key: str, count: int) -> np.ndarray:
    values = asked.get(key)
    if not isinstance(values, list) or len(values) != count or not all(map(_is_number, values)):
        raise _UnclearError(f"'{key}' must be a list of {count} numbers")
    if not all(abs(value) <= _LARGEST[key] for value in values):  # NaN is not
        raise _UnclearError(f"'{key}' has a number that is not finite, or beyond ±{_LARGEST[key]:g}")
    return np.array(values, dtype=float)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _payload(asked: Mapping[str, Any]) -> np.ndarray:
    """Mass (1,), kg; NaN stands for the declared one."""
    mass = asked.get("payload")
    if mass is None:
        return np.array([np.nan])
    if not _is_number(mass) or not 0 <= mass <= _LARGEST["payload"]:
        raise _UnclearError(f"'payload' must be a mass in kg, from 0 to {_LARGEST['payload']:g}")
    return np.array([mass], dtype=float)


def _pose(asked: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Position (1, 3), m, and rotation (1, 3, 3)."""
    position, turn = _numbers(asked, "position", 3), _numbers(asked, "quaternion_wxyz", 4)
    size = np.linalg.norm(turn)
    if not abs(size - 1) < 1e-3:
        raise _UnclearError("'quaternion_wxyz' must be a unit quaternion")
    return position[None], wxyz_rotation(turn / size)[None]


def _placed(position: np.ndarray, rotation: np.ndarray) -> dict[str, Any]:
    return {
        "status": DONE,
        "position": position.tolist(),
        "quaternion_wxyz": rotation_wxyz(rotation).tolist(),
    }
