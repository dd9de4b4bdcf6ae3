"""What fits to touches have in common: estimates, errors of every touch, and the part of them that is expected of the arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.touching.arm_errors import ArmErrors
from flexcal.data.poses import Touches
from flexcal.estimation import TwoVarianceFit


@dataclass(frozen=True, eq=False)
class TouchFit:
    """Fit to N touches.

    Attributes
    ----------
    fit : TwoVarianceFit
        Estimates, their covariance, and the sizes of the arm's errors and of touching.
    errors : ndarray
        Errors (N, k) of every touch, m: in the coordinates that it tells, NaN in others.
    kept : ndarray
        Whether (N,) the touch agrees with the others; the fit is that of these.
    arm : ArmErrors
        Errors of the arm at the touches.
    arm_rms : float
        Root mean square of the errors that is expected of the arm alone, m; of an arm that is not calibrated at the size that fits best.
    """

    fit: TwoVarianceFit
    errors: np.ndarray
    kept: np.ndarray
    arm: ArmErrors
    arm_rms: float

    @property
    def distances(self) -> np.ndarray:
        """Distance (N,) of the tip from where the fit has it at every touch, m."""
        return np.sqrt(np.nansum(self.errors**2, axis=1))

    @property
    def rms(self) -> float:
        """Root-mean-square distance of the touches that were kept, m."""
        return float(np.sqrt(np.mean(self.distances[self.kept] ** 2)))


def residual_rms(design: np.ndarray, covariance: np.ndarray, touches: int) -> float:
    """Root-mean-square residual distance (m) of least squares with errors of this covariance, of so many touches."""
    basis = np.linalg.qr(design)[0]
    left = np.trace(covariance) - np.trace(basis.T @ covariance @ basis)
    return float(np.sqrt(max(left, 0.0) / touches))


def without(touches: Touches, kept: np.ndarray) -> str:
    """Words for a message: without the touches that were not kept, by name."""
    wrong = np.flatnonzero(~kept)
    if not wrong.size:
        return ""
    return " without those that do not agree (" + "; ".join(touches.label(int(i)) for i in wrong) + ")"
