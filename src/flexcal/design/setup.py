"""What is measured, from where and how well: the target, the payload, the instrument and its reflector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.units import DEGREE


@dataclass(frozen=True)
class TrackerNoise:
    """Standard deviation an axis of a laser tracker: `constant` (m) + `proportional` (m per m of distance)."""

    constant: float = 15e-6
    proportional: float = 6e-6

    def std(self, distance: np.ndarray) -> np.ndarray:
        """Standard deviation (...), m, at `distance` (...), m."""
        return self.constant + self.proportional * distance


@dataclass(frozen=True, eq=False)
class Acceptance:
    """A reflector fixed to the tool sees within `half_angle` (rad) of `axis` (3,), given in the frame of its point.

    A spherically mounted reflector accepts ±30°. One that the user turns towards the instrument by hand needs none of this.
    """

    axis: np.ndarray
    half_angle: float = 30 * DEGREE

    def __post_init__(self) -> None:
        axis = np.asarray(self.axis, dtype=float)
        if axis.shape != (3,) or not np.linalg.norm(axis) > 0 or not 0 < self.half_angle <= np.pi:
            raise FlexcalError(
                "an acceptance needs an axis of three numbers, not all zero, and a half angle between 0 and π."
            )
        object.__setattr__(self, "axis", axis / np.linalg.norm(axis))


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
    acceptance: Acceptance | None = None


STANDARD = MeasuringSetup()
"""The first point, seen from the first station by a laser tracker, with the declared payload."""
