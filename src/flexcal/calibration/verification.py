"""How accurate the calibrated robot is on poses that the fit never saw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.elastic_prior import ElasticPrior
from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.flanks import ambiguous_poses
from flexcal.calibration.prediction import predict
from flexcal.data import PoseSet
from flexcal.model import RobotModel


@dataclass(frozen=True, eq=False)
class Verification:
    """Predicted and measured points of a set of poses.

    `position` (N, 3) as predicted, m; `errors` (N, 3) measured minus predicted; `std` (N,) predicted 1σ of the distance error from the
    parameters' covariance; `ambiguous` (N,) poses at which the flank of a backlash is not certain.
    """

    position: np.ndarray
    errors: np.ndarray
    std: np.ndarray
    ambiguous: np.ndarray

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

    The instrument must stand where it stood during calibration: `model` holds its place. Raises `FlexcalError` as `predict` does.
    """
    at = predict(model, poses, elastic=elastic, jacobians=True)
    parameters = model.posterior.parameters
    used = [n for n in parameters.names if _moves_points(n) and (elastic or not _is_elastic(n))]
    numbers = [parameters.index(name) for name in used]
    covariance = model.posterior.covariance[np.ix_(numbers, numbers)]
    slopes = parameters.subset(used).natural_slope(parameters.subset(used).coordinates())
    columns = at.jacobian(used) * slopes
    variance = np.einsum("nip,pq,niq->n", columns, covariance, columns)
    elastic_names = [name for name in used if _is_elastic(name)]
    keep = [used.index(name) for name in elastic_names]
    prior = ElasticPrior(parameters.subset(elastic_names), covariance[np.ix_(keep, keep)])
    return Verification(
        at.position, poses.position - at.position, np.sqrt(variance), ambiguous_poses(at, prior)
    )


def _is_elastic(name: str) -> bool:
    return name.endswith((".stiffness", ".mass", ".com_x", ".com_y", ".com_z"))


def _moves_points(name: str) -> bool:
    return not name.endswith((".damping", ".rotor_inertia", ".delay", ".viscous", ".coulomb"))
