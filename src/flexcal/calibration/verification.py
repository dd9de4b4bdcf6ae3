"""How accurate the calibrated robot is on poses that the fit never saw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.flanks import ambiguous_poses
from flexcal.calibration.measured_points import require_points
from flexcal.calibration.prediction import predict
from flexcal.data import PoseSet
from flexcal.model import RobotModel
from flexcal.model.names import GEOMETRY, STATION


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


_GEOMETRIC = (*GEOMETRY, *STATION, "backlash", "gravity_compliance")


def verify(model: RobotModel, poses: PoseSet, *, elastic: bool = True) -> Verification:
    """Compare a calibrated robot with points; `poses` should be none of those it was fitted to.

    The instrument must stand where it stood during calibration: `model` holds its place. Raises `FlexcalError` for measured lengths and
    orientations, and as `predict` does.
    """
    require_points(poses)
    at = predict(model, poses, elastic=elastic, jacobians=True)
    parameters = model.posterior.parameters
    used = [n for n in parameters.names if _moves_points(n) and (elastic or not _is_elastic(n))]
    covariance = model.posterior.marginal(used)
    slopes = parameters.subset(used).natural_slope(parameters.subset(used).coordinates())
    columns = at.jacobian(used) * slopes
    variance = np.einsum("nip,pq,niq->n", columns, covariance, columns)
    ambiguous = ambiguous_poses(model, at)
    return Verification(at.position, poses.position - at.position, np.sqrt(variance), ambiguous)


def _is_elastic(name: str) -> bool:
    return name.endswith((".stiffness", ".mass", ".com_x", ".com_y", ".com_z"))


def _moves_points(name: str) -> bool:
    key = name.rpartition(".")[2]
    return _is_elastic(name) or key in _GEOMETRIC or key.startswith("transmission_")
