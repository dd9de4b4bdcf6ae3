"""Measuring setup: target, payload, instrument and reflector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.robot import AcceptanceConfig, RobotModel


@dataclass(frozen=True)
class TrackerNoise:
    """Standard deviation an axis of a laser tracker: `constant` (m) + `proportional` (m per m of distance)."""

    constant: float = 15e-6
    proportional: float = 6e-6

    def std(self, distance: np.ndarray) -> np.ndarray:
        """Standard deviation (...), m, at `distance` (...), m."""
        return self.constant + self.proportional * distance


@dataclass(frozen=True)
class MeasuringSetup:
    """How poses are measured: the target `point` and the instrument's `station` by name (None: the first declared ones).

    `payload` in kg at the declared payload's centre of mass (None: the declared one), `noise` of the instrument, `acceptance` of the
    reflector (None: turned by hand, it is seen from everywhere).
    """

    point: str | None = None
    station: str | None = None
    payload: float | None = None
    noise: TrackerNoise = TrackerNoise()
    acceptance: AcceptanceConfig | None = None

    @classmethod
    def declared(cls, model: RobotModel, payload: float | None = None) -> MeasuringSetup:
        """The first point as robot.yaml declares it, with the acceptance of its reflector."""
        point = next(iter(model.config.points), None)
        return cls(
            payload=payload, acceptance=None if point is None else model.config.points[point].acceptance
        )


STANDARD = MeasuringSetup()
"""The first point, seen from the first station by a laser tracker, with the declared payload."""
