"""Measured points and their errors for several models, as plotted in the reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.measurement import predict_measurements
from flexcal.calibration.verification.uncalibrated_robot import UncalibratedErrors
from flexcal.calibration.verification.unseen_poses import PredictionErrors
from flexcal.data.poses import PoseSet

if TYPE_CHECKING:
    from flexcal.calibration.fit import GeometricFit

DECLARED, NOMINAL, OWN = "declared", "nominal", "own"
"""Names of the uncalibrated robot: as declared, best-fit registered, and registered with the measured points fitted too."""
RIGID, CALIBRATED = "rigid", "calibrated"
"""Names of the calibrated robot: fitted without further terms, and with the selected ones."""


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

    @classmethod
    def of_fit(cls, fit: GeometricFit, errors: Mapping[str, np.ndarray]) -> MeasuredPoints:
        """Points of a fit with what every model leaves of their readings, (N, 3) m; inclinometers tell none.

        Distances and contacts are put where the calibrated robot has its point, and their errors in the direction that they measure.
        """
        poses = fit.poses.pointed
        if poses.kind is not None and len(poses):
            at = predict_measurements(fit.model, poses)
            slopes = np.eye(3) if at.readings.slopes is None else at.readings.slopes
            errors = {name: np.matmul(left[:, None], slopes)[:, 0] for name, left in errors.items()}
            poses = replace(poses, position=at.located + errors[CALIBRATED])
        return cls(poses, errors, fit.ambiguous[~fit.poses.tilted])

    @property
    def calibrated(self) -> np.ndarray:
        """Errors (N, 3) m of the selected model."""
        return self.errors[CALIBRATED]

    @property
    def delivered(self) -> np.ndarray | None:
        """Errors (N, 3) m of the uncalibrated robot: with the points fitted too, else registered; None if neither is known."""
        return self.errors.get(OWN, self.errors.get(NOMINAL))

    @property
    def verification(self) -> PredictionErrors:
        """Errors of the selected model with their expected size by the parameters' covariance; raises `ValueError` if not computed."""
        if self.parameter_rms is None or self.scatter_rms is None:
            raise ValueError("points of a verification have the distances that the covariance predicts")
        position = self.poses.position - self.calibrated
        return PredictionErrors(
            position, self.calibrated, self.parameter_rms, self.scatter_rms, self.ambiguous
        )

    @property
    def shown(self) -> dict[str, np.ndarray]:
        """Errors shown in drawings of the arm: calibrated and, if known, uncalibrated."""
        shown = {CALIBRATED: self.calibrated}
        return shown if self.delivered is None else shown | {NOMINAL: self.delivered}

    @property
    def before(self) -> ErrorStatistics | None:
        """Statistics of the uncalibrated robot's errors; None if unknown."""
        return None if self.delivered is None else ErrorStatistics.of(self.delivered)

    def statistics(self, model: str) -> ErrorStatistics:
        """Error statistics of one model."""
        return ErrorStatistics.of(self.errors[model])


def errors_before(before: UncalibratedErrors) -> dict[str, np.ndarray]:
    """Errors of an uncalibrated robot by their names in `MeasuredPoints.errors`."""
    return {NOMINAL if name == "registered" else name: errors for name, errors in before.known.items()}
