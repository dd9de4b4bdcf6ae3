"""Measured points and their errors for several models, as the reports draw them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification.uncalibrated_robot import UncalibratedErrors
from flexcal.calibration.verification.unseen_poses import PredictionErrors
from flexcal.data.poses import PoseSet

DECLARED, NOMINAL, OWN = "declared", "nominal", "own"
"""The robot as delivered: as declared, best-fit registered, and registered with the measured points found too."""
RIGID, CALIBRATED = "rigid", "calibrated"
"""The robot fitted without further terms, and as it is used."""


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """N points in measuring order.

    `errors` (N, 3) m by model are measured minus predicted, in the instrument's frame; `ambiguous` (N,) poses at which the flank of a
    backlash is not certain. Distances that are predicted, None where they were not asked for: `parameter_rms` (N,) m from the parameters'
    covariance, `scatter_rms` (N,) m from instrument, robot and model error.
    """

    poses: PoseSet
    errors: Mapping[str, np.ndarray]
    ambiguous: np.ndarray
    parameter_rms: np.ndarray | None = None
    scatter_rms: np.ndarray | None = None

    @property
    def calibrated(self) -> np.ndarray:
        """Errors (N, 3) m of the model that is used."""
        return self.errors[CALIBRATED]

    @property
    def delivered(self) -> np.ndarray | None:
        """The robot's own errors (N, 3) m as delivered: with the points found too, else registered; None where neither is known."""
        return self.errors.get(OWN, self.errors.get(NOMINAL))

    @property
    def verification(self) -> PredictionErrors:
        """Errors of the model that is used, and what the parameters' covariance says of them; raises `ValueError` where that was not asked
        for."""
        if self.parameter_rms is None or self.scatter_rms is None:
            raise ValueError("points of a verification have the distances that the covariance predicts")
        position = self.poses.position - self.calibrated
        return PredictionErrors(
            position, self.calibrated, self.parameter_rms, self.scatter_rms, self.ambiguous
        )

    @property
    def shown(self) -> dict[str, np.ndarray]:
        """The errors that drawings of the arm show: calibrated, and as delivered where known."""
        shown = {CALIBRATED: self.calibrated}
        return shown if self.delivered is None else shown | {NOMINAL: self.delivered}

    @property
    def before(self) -> ErrorStatistics | None:
        """Of the robot's own errors as delivered; None where they are not known."""
        return None if self.delivered is None else ErrorStatistics.of(self.delivered)

    def statistics(self, model: str) -> ErrorStatistics:
        """Of one model's errors."""
        return ErrorStatistics.of(self.errors[model])


def errors_before(before: UncalibratedErrors) -> dict[str, np.ndarray]:
    """The errors of an uncalibrated robot by the names that they have among `MeasuredPoints.errors`."""
    return {NOMINAL if name == "registered" else name: errors for name, errors in before.known.items()}
