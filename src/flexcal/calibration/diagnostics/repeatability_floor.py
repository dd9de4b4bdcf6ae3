"""Scatter of the measured points that the geometry does not remove, as of play in the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from flexcal.calibration.fit import TOLERANCE, GeometricFit
from flexcal.calibration.measurement import METRES
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class RepeatabilityFloor:
    """Scatter from pose to pose about a fit: `distance`, m, root mean square, and the `angle`, rad (1σ), in every joint that explains it.

    `apart` tells whether the instrument's noise was stated, and is not in it.
    """

    distance: float
    angle: float
    apart: bool

    @classmethod
    @lru_cache(maxsize=1)
    def of(cls, fit: GeometricFit) -> RepeatabilityFloor | None:
        """Floor of a fit to points whose scatter exceeds tolerances of manufacture; None of others, whose geometry is what counts."""
        if not fit.poses.located.all():
            return None
        turns = fit.linear.turns[fit.linear.readings.unit == METRES]
        scatter = fit.robot_scatter
        lever = float(np.sqrt(np.mean((turns**2).sum(axis=1)))) if turns.size else 0.0
        if scatter < TOLERANCE["m"] or lever == 0:
            return None
        return cls(float(np.sqrt(3)) * scatter, scatter / lever, fit.poses.sigma_given)

    @property
    def joint_degrees(self) -> float:
        """The `angle` in degrees."""
        return float(np.rad2deg(self.angle))

    @property
    def sentence(self) -> str:
        """What it means, in a sentence."""
        whose = "the arm repeats" if self.apart else "arm and instrument together repeat"
        return (
            f"{self.distance / MILLIMETRE:.1f} mm (rms) of scatter from pose to pose remain beside the geometry, as of "
            f"{self.joint_degrees:.2g}° at every joint (1σ): {whose} no better, or something moved between the poses or while they were "
            "read, or the arm has errors beyond the terms of this fit; repeated visits to the same poses (flexcal repeatability) tell the "
            "first from the others"
        )

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {
            "rms_mm": self.distance / MILLIMETRE,
            "joint_deg": self.joint_degrees,
            "without_instrument": self.apart,
        }
