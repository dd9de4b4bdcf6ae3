"""How much geometry the points support: joint zeros alone, lengths of links too, or all errors of the axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.fit import LEAST_POSES, LEVELS, TOLERANCE, GeometricFit, fit_geometry
from flexcal.calibration.term_selection.cross_validation import folds_of, left_out_by
from flexcal.calibration.term_selection.leave_out_errors import LeaveOutErrors
from flexcal.calibration.term_selection.trials import TermTrials, mean_gain
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_SAME = 0.02
"""Relative difference of mean errors that does not matter."""
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

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        errors = ", ".join(
            f"{level.mean / MILLIMETRE:.1f} mm with {_SAID[level.level]}" for level in self.levels
        )
        own = _SAID[self.answer.level]
        held = {
            "offsets": "; lengths and axes stay as in the URDF, since the scatter hides what they are off, which intervals leave out",
            "lengths": "; axes stay as in the URDF, since the scatter hides how they are tilted, which intervals leave out",
            "kinematic": "",
        }[self.answer.level]
        return f"zeros or geometry: these points support {own} (mean error at left-out poses {errors}){held}"

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
