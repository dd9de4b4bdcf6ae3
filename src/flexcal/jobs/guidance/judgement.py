"""Judgement of a measured row, and findings on a series: a code, numbers, and a sentence for the person at the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.jobs.guidance.analysis import Analysis
from flexcal.jobs.guidance.disturbances import Disturbance, DisturbanceKind
from flexcal.report.results import chance_in_words
from flexcal.units import MILLIMETRE

JudgementCode = Literal[
    "good", "repeat", "wrong_row", "axes", "unit", "moved", "outlier", "drift", "misfit", "too_early"
]
BEYOND = 0.05
"""Probability of a point farther from where it is expected than the distance that is stated."""


@dataclass(frozen=True)
class Finding:
    """Disturbance of the series: its kind, the row of the session and the number of the pose at which it is or begins, its size, m, and
    its p-value; None where it is farther off than any error of a robot."""

    kind: DisturbanceKind
    row: int
    pose: int
    size: float
    p: float | None

    @property
    def sentence(self) -> str:
        """The finding in words."""
        if self.p is None and self.kind == "moved":
            return moved_far_text(self.pose)
        if self.p is None:
            return f"pose {self.pose} is {self.size / MILLIMETRE:.0f} mm from where the robot was; exclude it, or measure it again."
        size, p = f"{self.size / MILLIMETRE:.2g} mm", chance_in_words(self.p)
        if self.kind == "outlier":
            return f"pose {self.pose} is {size} off ({p}); exclude it, or measure it again."
        if self.kind == "moved":
            return (
                f"the tracker or the robot's base moved before pose {self.pose}: a rigid motion of {size} explains the rows from there on "
                f"({p}); give these another station of robot.yaml, or measure again from pose {self.pose}."
            )
        return f"the points drift by {size} over the series ({p}); wait until robot and instrument are warm, and measure again."

    @classmethod
    def of(cls, analysis: Analysis, item: Disturbance) -> Finding:
        """Finding on a disturbance of an analysis."""
        shift = analysis.shift_of(item)[0]
        if item.kind == "drift":
            size = float(np.linalg.norm(shift[-1] - shift[0]))
        else:
            size = float(np.linalg.norm(shift[item.row :], axis=1).mean()) if item.kind == "moved" else 0.0
            size = float(np.linalg.norm(shift[item.row])) if item.kind == "outlier" else size
        return cls(item.kind, int(analysis.index[item.row]), analysis.pose_of(item), size, item.p)


@dataclass(frozen=True)
class Judgement:
    """Judgement of a row.

    Attributes
    ----------
    code : str
        "good"; "repeat" of another pose; "wrong_row", "axes" and "unit" of one that was misread; "outlier"; "moved" where the instrument or
        the base moved, which this row makes certain; "drift" likewise; "misfit" where most points do not fit the robot at all; "too_early"
        where a wrong row could not be told yet.
    sentence : str
        What is to be said of it.
    pose : int or None
        Number of the other pose that is concerned.
    error : float or None
        Distance, m, of the point from where the other rows have it.
    expected : float or None
        Distance, m, that a good row exceeds in 5 of 100 cases.
    p : float or None
        p-value of what is said to be wrong, multiplied by the number of tries.
    noticeable : float or None
        Error, m, of one row that would surely be noticed now.
    """

    code: JudgementCode
    sentence: str
    pose: int | None = None
    error: float | None = None
    expected: float | None = None
    p: float | None = None
    noticeable: float | None = None

    @property
    def is_good(self) -> bool:
        """Whether nothing speaks against the row."""
        return self.code in ("good", "repeat", "too_early")

    @property
    def is_wrong(self) -> bool:
        """Whether the row itself is wrong, not the series."""
        return self.code in ("wrong_row", "axes", "unit", "outlier", "misfit")


def moved_far_text(pose: int) -> str:
    """Sentence on an instrument or a base that was moved by more than any error of the robot."""
    return (
        f"the points from pose {pose} on agree with each other, but not with those before: the tracker or the robot's base was moved by "
        f"centimetres before pose {pose}; give the rows from there on another station of robot.yaml."
    )


def radius(covariance: np.ndarray, beyond: float = BEYOND) -> float:
    """Length that a normal vector of this covariance (3, 3) exceeds with a probability, by two moments (Satterthwaite 1946)."""
    from scipy.special import chdtri

    trace, squares = float(np.trace(covariance)), float(np.sum(covariance**2))
    return float(np.sqrt(squares / trace * chdtri(trace**2 / squares, beyond)))
