"""Flank of the backlash of each joint at each pose, and whether it is certain."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.measurement.prediction import PredictedMeasurements
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.model.statics import are_flanks_certain, carried_mass


class OneFlank(FlexcalError):
    """A joint rests on the same flank of its backlash at all poses."""


def ambiguous_poses(model: RobotModel, prediction: PredictedMeasurements) -> np.ndarray:
    """Poses (N,) at which a joint with backlash carries too little torque for its sign to be certain.

    The torque is that of the `prediction` at rest; its standard deviation comes from what `model` knows of masses and centres of mass.
    """
    payload = carried_mass(model, prediction.poses.payload, len(prediction.poses))
    return ~are_flanks_certain(model, prediction.poses.q, prediction.rest.torque, payload)


def require_both_flanks(model: RobotModel, flank: np.ndarray) -> None:
    """Raise `OneFlank` naming the joints whose backlash is not separable from their offset because only one flank was measured."""
    for i in model.backlash_joints:
        seen = np.unique(flank[:, i])
        if not {-1.0, 1.0} <= set(seen):
            raise OneFlank(
                "E-CAL-010",
                f"{model.joints[i].name} rests on one flank of its backlash at all {len(flank)} poses, so backlash and joint "
                "offset are not identifiable separately; add poses loaded in the other direction, or take the joint out of "
                "`geometry: backlash:`.",
            )
