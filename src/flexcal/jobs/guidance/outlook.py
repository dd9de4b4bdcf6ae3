"""Next poses of a guided session and the tool error that they bring."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.jobs.guidance.batch_design import BatchDesign, OpenPoses
from flexcal.jobs.guidance.estimate import ROBOT_STD, SessionEstimate
from flexcal.jobs.guidance.pose_choice import PoseChoice
from flexcal.jobs.guidance.unknowns import Unknowns
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

FIRST = 25
"""Number of poses up to which those to come are chosen together, as each being the best after those before is a poor start."""
AHEAD = 10
"""Number of further poses whose gain decides whether to go on."""
WORTH = 0.05
"""Least gain of so many more poses, relative to the predicted error, for which it is worth going on."""
_DRAWS = 100
_QUANTILE = 0.9
_APART = 0.01
"""Difference of joint positions, rad or m, below which a candidate is a pose that was measured."""


@dataclass(frozen=True, eq=False)
class Outlook:
    """Next poses, the best first, and the error predicted at fresh poses.

    Attributes
    ----------
    q : ndarray
        Next poses (K, n), rad or m, each the best after those before it.
    pose : ndarray
        Their numbers (K,) among the candidates.
    measured : int
        Number of rows so far.
    p90 : ndarray
        Predicted 90 % quantile (K + 1,), m, of the distance error of the calibrated robot over the working poses, after none, one, … of the
        next poses, with the scatter of the robot itself.
    scatter : float
        What of it no pose removes: 90 % quantile, m, of the robot's scatter alone.
    desired : float or None
        Error, m, at which to stop.
    is_known : bool
        Whether the rows tell this robot's errors; before, the prediction is of the plausible sizes alone.
    anywhere : bool
        Whether the working poses are all over the workspace, for want of a working volume.
    """

    q: np.ndarray
    pose: np.ndarray
    measured: int
    p90: np.ndarray
    scatter: float
    desired: float | None
    is_known: bool
    anywhere: bool = True

    @property
    def gain(self) -> float:
        """What the next poses bring, m."""
        return float(self.p90[0] - self.p90[-1])

    @property
    def is_enough(self) -> bool:
        """Whether to stop: the desired error is reached, or the next poses bring little."""
        if not self.is_known:
            return False
        if self.desired is not None:
            return bool(self.p90[0] <= self.desired)
        return self.gain < WORTH * self.p90[0]

    @property
    def sentence(self) -> str:
        """Whether to stop, and why."""
        now, then = self.p90[0] / MILLIMETRE, self.p90[-1] / MILLIMETRE
        more = _more_poses(len(self.q))
        if not self.is_known:
            return f"go on: too few rows yet to say how accurate the robot will be; {more} predict a p90 of {then:.3f} mm."
        floor = ""
        if self.scatter > 0:
            floor = f"; the scatter of robot and instrument alone is {self.scatter / MILLIMETRE:.3f} mm"
        where = " anywhere in the workspace" if self.anywhere else " in the working volume"
        if self.desired is not None and not self.is_enough:
            wanted = np.flatnonzero(self.p90 <= self.desired)
            reach = (
                f"in {_more_poses(int(wanted[0]))}" if len(wanted) else f"not yet with {more} ({then:.3f} mm)"
            )
            return f"go on: p90 predicted {now:.3f} mm{where}, {self.desired / MILLIMETRE:.3f} mm are reached {reach}{floor}."
        if self.is_enough:
            return f"stop: p90 predicted {now:.3f} mm{where}, {more} bring {now - then:.3f} mm{floor}."
        return f"go on: p90 predicted {now:.3f} mm{where}, with {more} about {then:.3f} mm{floor}."


@dataclass(frozen=True, eq=False)
class Prospect:
    """What is known of the robot now: `model`, `unknowns`, and the `covariance` (p, p) of their errors; and the `choice` of poses.

    `share` of the instrument's stated noise is there, and the `scatter`, m, of the robot beside it.
    """

    choice: PoseChoice
    model: RobotModel
    unknowns: Unknowns
    covariance: np.ndarray
    like: PoseSet | None
    share: float
    scatter: float
    is_known: bool

    @classmethod
    def of(
        cls, model: RobotModel, choice: PoseChoice, rows: PoseSet | None, estimate: SessionEstimate | None
    ) -> Prospect:
        """Prospect after `rows` with their `estimate`, or before any with the plausible sizes."""
        if estimate is not None:
            return cls(
                choice, estimate.model, estimate.unknowns, estimate.geometry_covariance, estimate.rows, estimate.instrument_share,
                estimate.robot_std, True,
            )  # fmt: skip
        unknowns = Unknowns.of(model, choice.rows(model, choice.working, rows))
        return cls(choice, model, unknowns, np.eye(len(unknowns)), rows, 1.0, ROBOT_STD, False)

    def outlook(self, count: int = AHEAD, desired: float | None = None) -> Outlook:
        """The next `count` poses and the errors predicted after them, up to the `desired` one, m."""
        choice, working = self.choice, self._working
        information = np.linalg.inv(self.covariance)
        design = BatchDesign(choice, (information + information.T) / 2, working, self._open)
        poses = self._open(choice.q, choice.pose)

        def error(batch: OpenPoses, number: int) -> float:
            return _quantile(working, np.linalg.inv(information + batch.information(number)), self.scatter)

        measured = 0 if self.like is None else len(self.like)
        horizon = min(max(count, FIRST - measured), len(poses))
        batch = design.best(poses, horizon)
        if desired is not None and self.is_known:
            every = design.ordered(batch, horizon)
            enough = next((k for k in range(horizon) if error(every, k) <= desired), horizon)
            batch = design.best(poses, max(enough, 1))
        ahead = design.ordered(design.moved(batch), min(count, len(batch)))
        if len(ahead) < count:
            ahead = ahead.with_further(design.after(ahead, poses, count - len(ahead)))
        return Outlook(
            ahead.q,
            ahead.pose,
            measured,
            np.array([error(ahead, number) for number in range(len(ahead) + 1)]),
            _quantile(working[:, :, :1] * 0, np.eye(1), self.scatter),
            desired,
            self.is_known,
            choice.anywhere,
        )

    @property
    def p90(self) -> float:
        """Predicted 90 % quantile, m, as of an `Outlook`, without further poses."""
        return _quantile(self._working, self.covariance, self.scatter)

    @cached_property
    def _working(self) -> np.ndarray:
        """Derivatives (W, 3, p), m, of the points at the working poses."""
        rows = self.choice.rows(self.model, self.choice.working, self.like)
        return self.unknowns.columns(self.model, rows)[1]

    def _open(self, q: np.ndarray, pose: np.ndarray) -> OpenPoses:
        """Those of poses `q` (M, n) with numbers `pose` (M,) that are not measured."""
        if self.like is not None:
            apart = np.abs(q[:, None] - self.like.q[None]).max(axis=2).min(axis=1) > _APART
            q, pose = q[apart], pose[apart]
        rows = self.choice.rows(self.model, q, self.like)
        std = np.hypot(self.share * np.sqrt((rows.sigma**2).mean(axis=1)), self.scatter)
        return OpenPoses(q, pose, self.unknowns.columns(self.model, rows)[1] / std[:, None, None])


def _more_poses(count: int) -> str:
    return f"{count} more pose{'s' * (count != 1)}"


def _quantile(columns: np.ndarray, covariance: np.ndarray, scatter: float) -> float:
    """Quantile, m, of the lengths of errors at the working poses (W, 3, p), over the same random draws at every call."""
    rng = np.random.default_rng(0)
    values, vectors = np.linalg.eigh(covariance)
    draws = rng.standard_normal((len(values), _DRAWS))
    # the symmetric root, which changes little where the covariance does
    changes = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T @ draws
    errors = columns @ changes + scatter * rng.standard_normal((len(columns), 3, _DRAWS))
    return float(np.quantile(np.linalg.norm(errors, axis=1), _QUANTILE))
