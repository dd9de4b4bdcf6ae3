"""Ratio of the identified gravity torque on each joint to that of the URDF."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate, student_quantile
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.torques import torque_regressor

_POSES = 300
_LEAST = 0.1
"""Least root mean square gravity torque of a joint, relative to the largest, for a ratio."""
UNLIKE = 2.0
"""Ratio of identified gravity torque to that of the URDF, beyond which masses are guesses or something else carries the arm."""


@dataclass(frozen=True)
class GravityRatio:
    """Ratio of identified gravity torque to that of the URDF, and its 95 % interval from `low` to `high`."""

    share: float
    low: float
    high: float

    @property
    def unlike(self) -> bool:
        """Whether the whole interval lies beyond a factor of `UNLIKE`."""
        return self.high < 1 / UNLIKE or self.low > UNLIKE


def weight_shares(data: RegressionData, estimate: Estimate) -> dict[str, GravityRatio]:
    """Gravity ratio by joint: slope through zero of the identified gravity torque against that of the URDF over the joints' range.

    Joints without weight of their own, and those with a declared spring, which may carry it, are left out.
    """
    model = data.observation.model
    limits = np.array(
        [
            (j.lower, j.upper) if math.isfinite(j.lower) and math.isfinite(j.upper) else (-math.pi, math.pi)
            for j in model.joints
        ]
    )
    q = np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], (_POSES, model.n))
    still, links = np.zeros_like(q), len(LINK_PARAMETERS) * model.n
    columns = torque_regressor(model, q, still, still)
    declared = columns @ data.observation.values()[:links]
    size = np.sqrt(np.mean(declared**2, axis=0))
    sprung = {entry.joint for entry in model.config.dynamics.joint_springs}
    x, covariance = estimate.parameters.coordinates()[:links], estimate.covariance[:links, :links]
    quantile = student_quantile(0.975, max(1.0, estimate.covariance_freedom or estimate.degrees_of_freedom))
    ratios = {}
    for k, name in enumerate(model.joint_names):
        if size[k] <= _LEAST * size.max() or name in sprung:
            continue
        slope = declared[:, k] @ columns[:, k] / np.sum(declared[:, k] ** 2)
        share, half = float(slope @ x), quantile * math.sqrt(max(0.0, float(slope @ covariance @ slope)))
        ratios[name] = GravityRatio(share, share - half, share + half)
    return ratios
