"""On which side of its backlash a joint rests at each pose, and where that is not certain."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.elastic_prior import ElasticPrior
from flexcal.calibration.prediction import Prediction
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel

CERTAIN = 3.0
"""Standard deviations that the drive torque must be away from zero."""

RIGID_MARGIN = 0.05
"""Without a covariance of the inertias: the share of the largest torque that must be exceeded."""


def ambiguous_poses(prediction: Prediction, prior: ElasticPrior) -> np.ndarray:
    """Poses (N,) at which a joint with backlash carries too little torque for its sign to be certain.

    The torque is that of the identified model at rest; its standard deviation comes from the covariance of masses and centres of mass.
    """
    model = prediction.model
    axes = [tuple(a) for a in prediction.rest.axes]
    result = np.zeros(len(prediction.position), dtype=bool)
    for i in model.backlash_joints:
        torque = np.abs(prediction.rest.torque[:, i])
        margin = np.full(len(torque), RIGID_MARGIN * torque.max(initial=0.0))
        if (i, 2) in axes and len(prediction.rest.regressor) and len(prior.parameters):
            k = axes.index((i, 2))
            slopes = prior.parameters.natural_slope(prior.parameters.coordinates())
            rows = np.stack(
                [
                    np.zeros(len(torque))
                    if name.endswith("stiffness")
                    else prediction.load(name)[:, k] * slope
                    for name, slope in zip(prior.parameters.names, slopes, strict=True)
                ],
                axis=1,
            )
            margin = CERTAIN * np.sqrt(np.einsum("np,pq,nq->n", rows, prior.covariance, rows))
        result |= torque < margin
    return result


def require_both_flanks(model: RobotModel, flank: np.ndarray) -> None:
    """Raise `FlexcalError` naming the joints whose backlash cannot be told from their offset because one flank only was seen."""
    for i in model.backlash_joints:
        seen = np.unique(flank[:, i])
        if not {-1.0, 1.0} <= set(seen):
            raise FlexcalError(
                f"{model.joints[i].name} rests on one flank of its backlash at all {len(flank)} poses, so the backlash cannot be told "
                f"from the joint's offset; add poses loaded from the other side, or take the joint out of `geometry: backlash:`."
            )
