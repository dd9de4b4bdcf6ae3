"""Score test for a sensor whose temperatures lag those of the arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexcal.calibration.error_model import translations
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import Readings, predict_measurements
from flexcal.model.robot import EXPANSION

_CHANCE = 1e-6
"""Significance level: what else changes while the arm warms up must not be called a lag."""
_SHARE = 0.3
"""Least share of the residuals that a lag explains."""
_WINDOW, _ORDER = 9, 2
"""Rows and order of the polynomials by which temperatures are differentiated (Savitzky and Golay 1964)."""
_ROUGH = 0.2
"""Scatter of temperatures about these, relative to their standard deviation, above which they do not follow each other."""


@dataclass(frozen=True)
class SensorLag:
    """The sensor's temperatures lag the arm's by `lag` ± `std` (1σ), s, or rows where these are not `timed`; negative: ahead.

    `share` of the weighted squares of the residuals, 0 to 1, is explained by it, and `drift` by a drift at constant rate; `probability` is
    the p-value of the F test for none.
    """

    lag: float
    std: float
    share: float
    drift: float
    probability: float
    timed: bool

    @property
    def certain(self) -> bool:
        """Whether there is one: significant, a good part of the residuals, and more of them than a drift explains."""
        return self.probability < _CHANCE and self.share > max(_SHARE, self.drift)

    def document(self) -> dict[str, Any]:
        """Block of a JSON document."""
        return {
            "lag": self.lag,
            "std": self.std,
            "unit": "s" if self.timed else "rows",
            "share": self.share,
            "p": self.probability,
            "certain": self.certain,
        }

    @classmethod
    def of(cls, fit: GeometricFit) -> SensorLag | None:
        """First-order estimate with one further parameter of a fit with the expansion of the arm; None of others, and where temperatures do
        not follow each other from row to row.

        Points grow by the expansion times the temperature, which is the sensor's plus its rate times the lag.
        """
        from scipy.signal import savgol_filter
        from scipy.special import fdtrc

        poses = fit.poses
        known = EXPANSION in fit.estimate.parameters and fit.estimate.std(EXPANSION) is not None
        if not known or poses.temperature is None or not poses.located.all() or len(poses) <= 2 * _WINDOW:
            return None
        temperature, timed = (
            poses.temperature,
            poses.time is not None and bool((np.diff(poses.time) > 0).all()),
        )
        times = poses.time if timed and poses.time is not None else np.arange(len(poses), dtype=float)
        smooth = savgol_filter(temperature, _WINDOW, _ORDER)
        if np.std(temperature - smooth) > _ROUGH * np.std(temperature):
            return None
        steps = np.asarray(savgol_filter(times, _WINDOW, _ORDER, deriv=1), dtype=float)
        rate = np.asarray(savgol_filter(temperature, _WINDOW, _ORDER, deriv=1), dtype=float) / steps
        at = predict_measurements(fit.model, poses, jacobians=True)
        grown = np.zeros((len(poses), 6, 1))
        grown[:, :3, 0] = at.kinematics.position
        effect = at.moved(grown)[:, :, 0] * (fit.model.value(EXPANSION) * rate)[:, None]
        row = Readings.of(poses).row
        kept = ~np.isin(row, fit.estimate.outliers)
        # of orientations beside the points nothing is taken
        lagging = effect[row[kept], :, None] * (np.flatnonzero(kept) < len(poses))[:, None, None]
        ramp = np.linspace(-0.5, 0.5, len(poses))[row[kept]][:, None, None] * translations(
            fit.linear.readings
        )
        columns = np.concatenate([lagging, ramp], axis=2)
        products = fit.linear.products(replace(fit.scatter, order=0.0), columns)
        freedom = int(fit.linear.readings.present.sum()) - fit.linear.free.shape[2] - 1
        total, own, along = products[-1, -1], products[0, 0], products[0, -1]
        if freedom < 1 or own <= 0 or total <= 0:
            return None
        explained = along**2 / own
        left = max((total - explained) / freedom, 1.0)
        drift = np.linalg.lstsq(products[1:-1, 1:-1], products[1:-1, -1], rcond=1e-9)[0] @ products[1:-1, -1]
        return cls(
            float(along / own),
            float(np.sqrt(left / own)),
            float(explained / total),
            float(drift / total),
            float(fdtrc(1, freedom, explained / left)),
            timed,
        )
