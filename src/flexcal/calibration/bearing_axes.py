"""Whether measured points prefer bearings fixed to the parent link, or bearings that turn with the child: two fits compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.geometric_calibration import Calibration
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel
from flexcal.model.config import Bearings

_CERTAIN = 3.0
"""Vuong's statistic from which the preference is no chance."""

_RELEVANT = 0.95
"""Ratio of root mean square distances above which the better of the fits is no better for a user."""


@dataclass(frozen=True)
class BearingAxes:
    """Errors of a calibration with the `declared` bearings and of one with the other, at the same points.

    `statistic` is Vuong's (1989) for models of which neither contains the other: the sum over poses of the differences of the log
    likelihoods, each fit with the scatter that it leaves, over its standard deviation. Standard normal where both are equally far from
    the truth, whatever that is; positive where the declared fit better. `preferred` are the bearings with which the points are met
    clearly better, None where both do about as well.
    """

    declared: Bearings
    errors: ErrorStatistics
    other_errors: ErrorStatistics
    statistic: float
    preferred: Bearings | None

    @classmethod
    def compare(cls, fit: Calibration, other: Calibration) -> BearingAxes:
        """Two fits to the same poses, `other` with the bearings not declared; points that either takes for outliers do not count."""
        inside = np.setdiff1d(np.arange(len(fit.poses)), [*fit.estimate.outliers, *other.estimate.outliers])
        squares = np.array([np.sum(f.residuals[inside] ** 2, axis=1) for f in (fit, other)])
        variance = np.maximum(squares.mean(axis=1, keepdims=True) / 3, np.finfo(float).tiny)
        likelihood = -1.5 * np.log(variance) - squares / (2 * variance)
        places = np.unique(fit.poses.q[inside].round(6), axis=0, return_inverse=True)[1].ravel()
        gain = np.bincount(places, likelihood[0] - likelihood[1])
        spread = np.sqrt(len(gain)) * gain.std()
        statistic = float(gain.sum() / spread) if spread > 0 else 0.0
        better, worse = np.sqrt(np.sort(variance.ravel()))
        clear = abs(statistic) > _CERTAIN and better < _RELEVANT * worse
        robots = (fit.model, other.model)
        preferred = robots[0 if statistic > 0 else 1].config.bearings if clear else None
        return cls(fit.model.config.bearings, fit.errors, other.errors, statistic, preferred)

    @property
    def contradicted(self) -> bool:
        """Whether the points clearly prefer the bearings that are not declared."""
        return self.preferred not in (None, self.declared)


def compare_bearings(
    model: RobotModel, fit: Calibration, refit: Callable[[RobotModel, tuple[str, ...]], Calibration]
) -> BearingAxes | None:
    """The `fit` of a robot beside what `refit` makes of its points and terms with the other bearings.

    Where the points contradict the declaration, that must hold with transmission errors in both fits, too: bearings of the wrong kind can
    take a part of those up. None for a robot without bearings, or where a robot with the others has no fit.
    """
    if not any(joint.bearings for joint in model.elastic):
        return None
    before, after = get_args(Bearings)
    other = model.with_bearings(before if model.config.bearings == after else after)
    harmonics = tuple(f"transmission_{order}" for order in model.harmonics)
    wider = tuple(dict.fromkeys((*fit.terms, *harmonics)))
    try:
        found = BearingAxes.compare(fit, refit(other, fit.terms))
        if not found.contradicted or wider == fit.terms:
            return found
        again = BearingAxes.compare(refit(model, wider), refit(other, wider))
    except FlexcalError:
        return None
    return found if again.preferred == found.preferred else replace(found, preferred=None)
