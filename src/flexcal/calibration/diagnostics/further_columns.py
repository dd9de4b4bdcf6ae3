"""Columns of effects that a fit has not, by its readings, for score tests."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.error_model import translations
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import Readings


def columns_of_points(fit: GeometricFit, effects: np.ndarray) -> np.ndarray:
    """Columns (R, 3, k) of effects (N, 3, k) on the points; of orientations beside the points nothing is taken, nor of outliers."""
    row, number = _kept(fit)
    return effects[row] * (number < len(fit.poses))[:, None, None]


def columns_of_drift(fit: GeometricFit) -> np.ndarray:
    """Columns (R, 3, 3) of a drift at constant rate, from -1/2 to 1/2 in measuring order, of the points that are located."""
    return ramp(fit)[_kept(fit)[0]][:, None, None] * translations(fit.linear.readings)


def ramp(fit: GeometricFit) -> np.ndarray:
    """Share (N,) of a drift that a row has; zero where its point is not located by an instrument."""
    return np.linspace(-0.5, 0.5, len(fit.poses)) * fit.poses.located


def _kept(fit: GeometricFit) -> tuple[np.ndarray, np.ndarray]:
    """Row and number (R,) of the readings that are not outliers."""
    row = Readings.of(fit.poses).row
    number = np.flatnonzero(~np.isin(row, fit.estimate.outliers))
    return row[number], number
