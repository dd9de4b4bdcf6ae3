"""Score test for a sensor whose temperatures lag those of the arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.diagnostics.further_columns import columns_of_drift, columns_of_points
from flexcal.calibration.diagnostics.lag import Lag, measuring_times
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import predict_measurements
from flexcal.model.robot import EXPANSION

_WINDOW, _ORDER = 9, 2
"""Rows and order of the polynomials by which temperatures are differentiated (Savitzky and Golay 1964)."""
_ROUGH = 0.2
"""Scatter of temperatures about these, relative to their standard deviation, above which they do not follow each other."""


@dataclass(frozen=True)
class SensorLag(Lag):
    """The sensor's temperatures lag the arm's; its rival is a drift at constant rate."""

    least_share = 0.3
    rows = "rows"

    @classmethod
    def of(cls, fit: GeometricFit) -> SensorLag | None:
        """First-order estimate with one further parameter of a fit with the expansion of the arm; None of others, and where temperatures do
        not follow each other from row to row.

        Points grow by the expansion times the temperature, which is the sensor's plus its rate times the lag.
        """
        poses = fit.poses
        known = EXPANSION in fit.estimate.parameters and fit.estimate.std(EXPANSION) is not None
        if not known or poses.temperature is None or not poses.located.all() or len(poses) <= 2 * _WINDOW:
            return None
        from scipy.signal import savgol_filter  # loads half of SciPy: late

        temperature, (times, timed) = poses.temperature, measuring_times(poses)
        smooth = savgol_filter(temperature, _WINDOW, _ORDER)
        if np.std(temperature - smooth) > _ROUGH * np.std(temperature):
            return None
        steps = np.asarray(savgol_filter(times, _WINDOW, _ORDER, deriv=1), dtype=float)
        rate = np.asarray(savgol_filter(temperature, _WINDOW, _ORDER, deriv=1), dtype=float) / steps
        at = predict_measurements(fit.model, poses, jacobians=True)
        grown = np.zeros((len(poses), 6, 1))
        grown[:, :3, 0] = at.kinematics.position
        effect = at.moved(grown)[:, :, 0] * (fit.model.value(EXPANSION) * rate)[:, None]
        columns = np.concatenate([columns_of_points(fit, effect[:, :, None]), columns_of_drift(fit)], axis=2)
        products = fit.linear.products_in_time(fit.scatter, columns)
        return cls.by_products(products, slice(1, -1), fit.linear.freedom - 1, timed, 1.0)
