"""Measuring setup: target, payload, instrument and reflector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.robot import AcceptanceConfig, RobotModel


@dataclass(frozen=True)
class TrackerNoise:
    """Standard deviation per axis of a laser tracker: `constant` (m) + `proportional` (m per m of distance)."""

    constant: float = 15e-6
    proportional: float = 6e-6

    def std(self, distance: np.ndarray) -> np.ndarray:
        """Standard deviation (...), m, at `distance` (...), m."""
        return self.constant + self.proportional * distance


@dataclass(frozen=True)
class MeasuringSetup:
    """Measuring setup: target point, instrument and payload.

    Parameters
    ----------
    point : str, optional
        Name of the target point; by default the first declared one.
    station : str, optional
        Name of the instrument's place; by default the first declared one.
    payload : float, optional
        Mass, kg, at the declared payload's centre of mass; by default as declared.
    noise : TrackerNoise
        Noise of the instrument.
    acceptance : AcceptanceConfig, optional
        Acceptance of the reflector; without, it is turned by hand and seen from everywhere.
    measure : str, optional
        Name of the instrument under `measurements:`, or "pose" for a tracker of orientations too; by default a tracker of points.
    """

    point: str | None = None
    station: str | None = None
    payload: float | None = None
    noise: TrackerNoise = TrackerNoise()
    acceptance: AcceptanceConfig | None = None
    measure: str | None = None

    @classmethod
    def declared(
        cls, model: RobotModel, payload: float | None = None, measure: str | None = None
    ) -> MeasuringSetup:
        """Measuring setup with the first point as robot.yaml declares it, and the acceptance of its reflector.

        Parameters
        ----------
        model : RobotModel
            The robot.
        payload : float, optional
            Mass, kg; by default as declared.
        measure : str, optional
            Name of the instrument; by default a tracker.

        Returns
        -------
        MeasuringSetup
            The setup.
        """
        point = next(iter(model.config.points), None)
        shown = point is not None and measure in (None, "pose")
        return cls(
            payload=payload,
            acceptance=model.config.points[point].acceptance if shown and point is not None else None,
            measure=measure,
        )


STANDARD = MeasuringSetup()
"""Standard setup: the first point, seen from the first station by a laser tracker, with the declared payload."""
