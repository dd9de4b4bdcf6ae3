"""How much geometry the points support: joint zeros alone, lengths of links too, or all errors of the axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.fit import (
    LEAST_POSES,
    LEVELS,
    TOLERANCE,
    GeometricFit,
    fit_geometry,
    geometric_parameters,
    plausible_size,
)
from flexcal.calibration.term_selection.cross_validation import folds_of, left_out_by
from flexcal.calibration.term_selection.leave_out_errors import LeaveOutErrors
from flexcal.calibration.term_selection.trials import TermTrials, mean_gain
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_SAME = 0.02
"""Relative difference of mean errors that does not matter."""
_HAND_MADE = {"m": 1e-3, "rad": 1e-2}
"""Tolerances (1σ) of lengths and axes of printed or bent links, by unit, for robots whose scatter hides them."""
_SAID = {
    "offsets": "joint zeros alone",
    "lengths": "joint zeros and lengths of links",
    "kinematic": "the whole geometry",
}


@dataclass(frozen=True, eq=False)
class LevelFit:
    """Rigid fit of one of the `LEVELS`, the number of its determined parameters, and its errors at left-out poses."""

    level: str
    fit: GeometricFit
    left_out: LeaveOutErrors
    deciding: tuple[int, ...]

    @property
    def mean(self) -> float:
        """Mean error at left-out poses, m."""
        return self.left_out.mean(self.deciding)


@dataclass(frozen=True, eq=False)
class ZerosOrGeometry:
    """Comparison of the levels of geometry; `answer` is the simplest that predicts left-out poses as well as the best does.

    As well: its mean error is not larger by more than a standard error of the paired difference (Breiman et al. 1984), or by 2 %.
    """

    levels: tuple[LevelFit, ...]
    answer: LevelFit

    def with_tolerances(self, model: RobotModel, poses: PoseSet) -> RobotModel:
        """Robot whose lengths and axes beyond the answer's level have the tolerances of hand-made links as a prior."""
        own = geometric_parameters(model, poses, (self.answer.level,)).names
        beyond = {
            item.name: max(_HAND_MADE[item.unit], plausible_size(model, item.name))
            for item in geometric_parameters(model, poses, ("kinematic",))
            if item.name not in own and not np.isfinite(item.prior_std)
        }
        return model.with_priors(beyond)

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        errors = ", ".join(
            f"{level.mean / MILLIMETRE:.1f} mm with {_SAID[level.level]}" for level in self.levels
        )
        own = _SAID[self.answer.level]
        said = f"zeros or geometry: these points support {own} (mean error at left-out poses {errors})"
        if self.answer.level == "kinematic":
            return said
        zeros = self.answer.level == "offsets"
        rest, length = (
            ("lengths and axes", f"{_HAND_MADE['m'] / MILLIMETRE:g} mm and ") if zeros else ("axes", "")
        )
        return (
            f"{said}; the scatter hides what {rest} are off, which are taken as those of the URDF with standard deviations of "
            f"{length}{np.rad2deg(_HAND_MADE['rad']):.1f}° (robot.yaml may state others: `prior:`)"
        )

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {
            "answer": self.answer.level,
            "levels": [
                {
                    "terms": level.level,
                    "parameters": level.left_out.freedom,
                    "cross_validation_mm": level.mean / MILLIMETRE,
                }
                for level in self.levels
            ],
        }


def asks_for_levels(fit: GeometricFit) -> bool:
    """Whether the scatter of a rigid fit to points exceeds tolerances of manufacture, so that it may hide errors of the geometry."""
    if not fit.poses.located.all() or len(fit.poses) < LEAST_POSES:
        return False
    return fit.robot_scatter > TOLERANCE["m"]


def zeros_or_geometry(model: RobotModel, poses: PoseSet) -> ZerosOrGeometry | None:
    """Fit the levels of geometry, and compare them at left-out poses; None for fewer than 20 different poses."""
    folds, distinct = folds_of(poses)
    if distinct < LEAST_POSES:
        return None
    further = ("backlash",) if model.backlash_joints else ()
    levels = []
    for level in LEVELS:
        fit = fit_geometry(model, poses, terms=(level, *further), elastic=False)
        trials = TermTrials(fit, fit.model, fit.terms, folds, by=left_out_by(poses, distinct))
        levels.append(LevelFit(level, fit, trials.determined(), trials.deciding))
    best = min(levels, key=lambda level: level.mean)
    answer = next(level for level in levels if _as_well(level, best, folds))
    return ZerosOrGeometry(tuple(levels), answer)


def _as_well(level: LevelFit, best: LevelFit, folds: tuple[np.ndarray, ...]) -> bool:
    gains = [
        mean_gain(folds[k], level.left_out.distances[k], best.left_out.distances[k]) for k in level.deciding
    ]
    return all(gain <= max(error, _SAME * level.mean) for gain, error in gains)
