"""Next poses of a guided session and the tool error that they bring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.design.optimality import TraceOptimal, exchange_on_shortlist, greedy
from flexcal.estimation import Parameter, Parameters, Sensitivity
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
        more = f"{len(self.q)} more poses"
        if not self.is_known:
            return f"go on: too few rows yet to say how accurate the robot will be; {more} predict a p90 of {then:.3f} mm."
        floor = ""
        if self.scatter > 0:
            floor = f"; the scatter of robot and instrument alone is {self.scatter / MILLIMETRE:.3f} mm"
        where = " anywhere in the workspace" if self.anywhere else " in the working volume"
        if self.desired is not None and not self.is_enough:
            wanted = np.flatnonzero(self.p90 <= self.desired)
            reach = (
                f"in {int(wanted[0])} more poses" if len(wanted) else f"not yet with {more} ({then:.3f} mm)"
            )
            return f"go on: p90 predicted {now:.3f} mm{where}, {self.desired / MILLIMETRE:.3f} mm are reached {reach}{floor}."
        if self.is_enough:
            return f"stop: p90 predicted {now:.3f} mm{where}, {more} bring {now - then:.3f} mm{floor}."
        return f"go on: p90 predicted {now:.3f} mm{where}, with {more} about {then:.3f} mm{floor}."


@dataclass(frozen=True, eq=False)
class Prospect:
    """What is known of the robot now: `model`, `unknowns`, and the `covariance` (p, p) of their errors.

    `share` of the instrument's stated noise is there, and the `scatter`, m, of the robot beside it.
    """

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
                estimate.model, estimate.unknowns, estimate.geometry_covariance, estimate.rows, estimate.instrument_share,
                estimate.robot_std, True,
            )  # fmt: skip
        unknowns = Unknowns.of(model, choice.rows(model, choice.working, rows))
        return cls(model, unknowns, np.eye(len(unknowns)), rows, 1.0, ROBOT_STD, False)

    def outlook(self, choice: PoseChoice, count: int, desired: float | None) -> Outlook:
        """The next `count` poses of a choice and the errors predicted after them."""
        free = np.ones(len(choice.q), bool)
        if self.like is not None:
            apart = np.abs(choice.q[:, None] - self.like.q[None]).max(axis=2)
            free = apart.min(axis=1) > _APART
        index = np.flatnonzero(free)
        count = min(count, len(index))
        rows = choice.rows(self.model, choice.q[index], self.like)
        std = np.hypot(self.share * np.sqrt((rows.sigma**2).mean(axis=1)), self.scatter)
        columns = self.unknowns.columns(self.model, rows)[1] / std[:, None, None]
        working = self.unknowns.columns(self.model, choice.rows(self.model, choice.working, self.like))[1]
        information = np.linalg.inv(self.covariance)
        flat = working.reshape(-1, working.shape[2])
        items = Parameters(Parameter(name, "1", 0.0) for name in self.unknowns.names)
        sensitivity = Sensitivity(columns, items, (information + information.T) / 2)
        error = TraceOptimal(flat.T @ flat / len(working), "c")
        horizon = min(max(count, FIRST - (0 if self.like is None else len(self.like))), len(index))
        together = exchange_on_shortlist(sensitivity, horizon, error).chosen.astype(int)
        chosen = together[greedy(sensitivity.subset(together), count, error).chosen.astype(int)]
        p90 = []
        for number in range(count + 1):
            added = columns[chosen[:number]].reshape(-1, columns.shape[2])
            covariance = np.linalg.inv(information + added.T @ added)
            p90.append(_quantile(working, covariance, self.scatter))
        alone = _quantile(working[:, :, :1] * 0, np.eye(1), self.scatter)
        return Outlook(
            choice.q[index[chosen]],
            choice.pose[index[chosen]],
            0 if self.like is None else len(self.like),
            np.array(p90),
            alone,
            desired,
            self.is_known,
            choice.anywhere,
        )


def _quantile(columns: np.ndarray, covariance: np.ndarray, scatter: float) -> float:
    """Quantile, m, of the lengths of errors at the working poses (W, 3, p), over the same random draws at every call."""
    rng = np.random.default_rng(0)
    values, vectors = np.linalg.eigh(covariance)
    draws = rng.standard_normal((len(values), _DRAWS))
    changes = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * draws)
    errors = columns @ changes + scatter * rng.standard_normal((len(columns), 3, _DRAWS))
    return float(np.quantile(np.linalg.norm(errors, axis=1), _QUANTILE))
