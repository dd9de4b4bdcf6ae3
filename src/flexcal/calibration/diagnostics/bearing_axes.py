"""Comparison of bearing axes fixed to the parent link with axes that turn with the child, from measured points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import GeometricFit
from flexcal.errors import FlexcalError
from flexcal.estimation import vuong_statistic
from flexcal.model.parts import Bearings
from flexcal.model.robot import RobotModel

_CERTAIN = 3.0
"""Vuong's statistic from which a preference is significant."""

_RELEVANT = 0.95
"""Ratio of root mean square distances above which the better fit has no practical advantage."""


@dataclass(frozen=True)
class BearingAxes:
    """Comparison of fits with bearings that tilt `before` and `after` the joint's rotation, from measured points.

    `declared` are those that robot.yaml or stage 1 says, None where neither does. `statistic` is Vuong's (1989) for models of which neither
    contains the other: the sum over poses of the differences of the log likelihoods, each fit with the scatter that it leaves, over its
    standard deviation. Standard normal where both are equally far from the truth, whatever that is; positive where `before` fits better.
    `preferred` are the bearings with which the points are met clearly better, None where both do about as well.
    """

    declared: Bearings | None
    errors: Mapping[Bearings, ErrorStatistics]
    statistic: float
    preferred: Bearings | None

    @classmethod
    def compare(cls, declared: Bearings | None, before: GeometricFit, after: GeometricFit) -> BearingAxes:
        """Comparison of two fits to the same poses, without the outliers of either."""
        outliers = {*before.estimate.outliers, *after.estimate.outliers}
        inside = np.setdiff1d(np.arange(len(before.poses)), list(outliers))
        first, second = (f.residuals[inside].ravel() for f in (before, after))
        places = np.unique(before.poses.q[inside].round(6), axis=0, return_inverse=True)[1].ravel()
        statistic = vuong_statistic(first, second, np.repeat(places, 3))
        better, worse = sorted(np.linalg.norm(rows) for rows in (first, second))
        clear = abs(statistic) > _CERTAIN and better < _RELEVANT * worse
        preferred: Bearings = "before" if statistic > 0 else "after"
        errors: dict[Bearings, ErrorStatistics] = {"before": before.errors, "after": after.errors}
        return cls(declared, errors, statistic, preferred if clear else None)

    @property
    def contradicted(self) -> bool:
        """Whether the points clearly prefer other bearings than the declared ones."""
        return self.declared is not None and self.preferred not in (None, self.declared)


def compare_bearings(model: RobotModel, fit: Callable[[RobotModel], GeometricFit]) -> BearingAxes | None:
    """Compare the `fit` of a robot with that of the same robot with the other bearing axes.

    Both are to have transmission errors: bearings of the wrong kind can take a part of those up. None for a robot without bearings, or
    where one of the two has no fit.
    """
    if not model.has_bearings:
        return None
    try:
        before, after = (fit(model.with_bearings(bearings)) for bearings in get_args(Bearings))
    except FlexcalError:
        return None
    return BearingAxes.compare(model.config.bearings, before, after)
