"""How far the uncalibrated robot is from the calibrated one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.kinds import best_motion
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest

_BLOCK = 8192
_FEWEST = 4
"""Number of points below which a motion of the whole robot explains everything."""


@dataclass(frozen=True, eq=False)
class Registration:
    """Place of the rigid `nominal` robot beside the calibrated one `model`: `rotation` (3, 3) and `translation` (3,), m.

    Both are compared at the point `target` under `payload` kg; `temperature` in °C is the calibrated robot's, None that at which its
    parameters hold.
    """

    model: RobotModel
    nominal: RobotModel
    target: str
    payload: float
    temperature: float | None
    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def of(
        cls,
        model: RobotModel,
        nominal: RobotModel,
        q: np.ndarray,
        target: str,
        payload: float,
        temperature: float | None = None,
    ) -> Registration | None:
        """The rigid motion that fits best over poses `q` (N, n), as an instrument would register the robot (Kabsch 1976); None for fewer
        than four poses.
        """
        if len(q) < _FEWEST:
            return None
        together = cls(model, nominal, target, payload, temperature, np.eye(3), np.zeros(3))
        real, expected = together._points(q)
        rotation, translation = best_motion(expected, real)
        return replace(together, rotation=rotation, translation=translation)

    def distance(self, q: np.ndarray) -> np.ndarray:
        """Distance (N,), m, between the points of both robots at poses `q` (N, n)."""
        real, expected = self._points(q)
        return np.linalg.norm(real - expected @ self.rotation.T - self.translation, axis=1)

    def _points(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 3) of the calibrated and of the nominal robot, each in its own base frame."""
        real, expected = np.empty((len(q), 3)), np.empty((len(q), 3))
        for first in range(0, len(q), _BLOCK):
            rows = slice(first, first + _BLOCK)
            names, mass = np.full(len(q[rows]), self.target), np.full(len(q[rows]), self.payload)
            warm = None if self.temperature is None else np.full(len(q[rows]), self.temperature)
            real[rows] = tool_at_rest(self.model, q[rows], mass, names, temperature=warm).kinematics.position
            expected[rows] = tool_at_rest(
                self.nominal, q[rows], mass, names, elastic=False
            ).kinematics.position
        return real, expected


def distance_to_nominal(
    model: RobotModel,
    nominal: RobotModel,
    q: np.ndarray,
    target: str,
    payload: float,
    temperature: float | None = None,
) -> np.ndarray | None:
    """Distance (N,), m, between a point of the calibrated robot `model` under `payload` kg and of the rigid `nominal` one at `q` (N, n).
    `temperature` in °C is the calibrated robot's, by default that at which its parameters hold.

    The nominal robot is placed by the `Registration` over all poses. None for fewer than four poses.
    """
    place = Registration.of(model, nominal, q, target, payload, temperature)
    return None if place is None else place.distance(q)
