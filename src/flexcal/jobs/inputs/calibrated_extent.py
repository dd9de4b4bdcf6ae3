"""Where the predicted errors of a calibration are far larger than at its poses."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.accuracy import predicted_rms
from flexcal.calibration.measurement import propagation
from flexcal.errors import FlexcalError
from flexcal.jobs.inputs.stored_model import CalibratedRobot
from flexcal.report.checks import BEYOND
from flexcal.units import MILLIMETRE

PREDICTED = "predicted_error"
"""Among the ranges of a calibration: predicted errors, m (rms), at its poses, and where the robot will work."""


def beyond_calibration(
    calibrated: CalibratedRobot, q: np.ndarray, targets: np.ndarray | None = None
) -> np.ndarray:
    """Predicted errors (N,), m, at poses `q` (N, n) where these are above three times those at the poses of the calibration, else 0.

    Of the `targets` (N,), by default the first measured point; of frames that are no points 0. All are 0 where the calibration does not
    say how large errors are at its poses. How the flange is turned and where a point lies on it, where no measured point tells, is the
    same at all poses, and part of the errors but not of the comparison.
    """
    if targets is not None:
        found = np.zeros(len(q))
        for name in set(targets.tolist()) & set(calibrated.probable.points):
            own = targets == name
            found[own] = _beyond(calibrated, q[own], name)
        return found
    return _beyond(calibrated, q, None)


def _beyond(calibrated: CalibratedRobot, q: np.ndarray, target: str | None) -> np.ndarray:
    if (
        not len(q)
        or "calibration" not in calibrated.blocks
        or PREDICTED not in calibrated.blocks["calibration"].ranges
    ):
        return np.zeros(len(q))
    inside = calibrated.blocks["calibration"].ranges[PREDICTED][0]
    robot, name = calibrated.probable, target or next(iter(calibrated.measured), None)
    try:
        errors = predicted_rms(propagation(robot, target=name), q)
        compared = errors
        if name not in calibrated.measured and calibrated.unseen is not robot:
            everywhere = predicted_rms(propagation(calibrated.unseen, target=name), q)
            compared = np.sqrt(np.maximum(errors**2 - everywhere**2, 0.0))
    except FlexcalError:
        return np.zeros(len(q))
    return np.where(compared > BEYOND * inside, errors, 0.0)


def beyond_remark(calibrated: CalibratedRobot, errors: np.ndarray, what: str) -> tuple[str, ...]:
    """Remark on the `errors` (N,), m, of `beyond_calibration` at poses or targets, `what` they are; none if there are none."""
    if not errors.any():
        return ()
    inside = calibrated.blocks["calibration"].ranges[PREDICTED][0]
    return (
        f"at {np.count_nonzero(errors)} of {len(errors)} {what} the predicted error is above three times that near the calibrated poses "
        f"({inside / MILLIMETRE:.2g} mm rms), up to {errors.max() / MILLIMETRE:.2g} mm; calibrate on poses of the working volume",
    )
