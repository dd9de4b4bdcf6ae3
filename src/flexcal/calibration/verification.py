"""How accurate the calibrated robot is on poses that the fit never saw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.flanks import ambiguous_poses
from flexcal.calibration.measured_points import require_points
from flexcal.calibration.prediction import predict
from flexcal.calibration.propagated_covariance import covariance_root, moving_parameters
from flexcal.data import PoseSet
from flexcal.model import RobotModel


@dataclass(frozen=True, eq=False)
class Verification:
    """Predicted and measured points of a set of poses.

    `position` (N, 3) as predicted, m; `errors` (N, 3) measured minus predicted; `parameter_rms` (N,) m, the root mean square distance
    error that the parameters' covariance alone predicts: noise of instrument and encoders comes on top; `ambiguous` (N,) poses at which
    the flank of a backlash is not certain.
    """

    position: np.ndarray
    errors: np.ndarray
    parameter_rms: np.ndarray
    ambiguous: np.ndarray

    def expected_rms(self, noise: np.ndarray | None = None) -> np.ndarray:
        """Root mean square distance error (N,) m that is predicted, with 1σ `noise` (N, 3) m of the measured coordinates where given."""
        return (
            self.parameter_rms if noise is None else np.sqrt(self.parameter_rms**2 + (noise**2).sum(axis=1))
        )

    @property
    def all(self) -> ErrorStatistics:
        """Over all poses."""
        return ErrorStatistics.of(self.errors)

    @property
    def unambiguous(self) -> ErrorStatistics:
        """Over the poses whose flank is certain."""
        return ErrorStatistics.of(self.errors[~self.ambiguous])


def verify(model: RobotModel, poses: PoseSet, *, elastic: bool = True) -> Verification:
    """Compare a calibrated robot with points; `poses` should be none of those it was fitted to.

    The instrument must stand where it stood during calibration: `model` holds its place. Raises `FlexcalError` for measured lengths and
    orientations, and as `predict` does.
    """
    return verify_jointly(model, poses, elastic=elastic)[0]


def verify_jointly(
    model: RobotModel, poses: PoseSet, *, elastic: bool = True
) -> tuple[Verification, np.ndarray]:
    """As `verify`, and A (N, 3, p) m, with p independent errors of one size behind all poses.

    A_i A_jᵀ is what the covariance of a calibrated robot's parameters says of the errors at the poses i and j.
    """
    require_points(poses)
    at = predict(model, poses, elastic=elastic, jacobians=True)
    used = moving_parameters(model, elastic=elastic)
    roots = at.jacobian(used) @ covariance_root(model, used)
    rms = np.sqrt((roots**2).sum(axis=(1, 2)))
    return Verification(at.position, poses.position - at.position, rms, ambiguous_poses(model, at)), roots
