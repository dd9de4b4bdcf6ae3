"""Choice of the poses that show shifts of single joints best, and tell them from each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.recheck import planned_errors
from flexcal.data.poses import PoseSet
from flexcal.model.robot import GEOMETRY, STATION, RobotModel

_SWEEPS = 5
_FLOOR = 1e-6
"""Information on a joint, relative to the largest, below which it counts as none."""
_APART = 2.0
"""Weight of what other changes explain of a shift, beside how well it is seen."""
_SAME = 0.02
"""Least share of a shift that a rival leaves unexplained; less counts as the same."""


def best_poses(information: PoseInformation, count: int, *, refit: bool) -> np.ndarray:
    """Indices (count,) of the candidates that make the least certain shift of a joint as certain as can be.

    The criterion is the sum over the joints of (v_k / least v_k)² (1 + w (mean 1/(1 − R²) − 1)): v_k is the variance of the shift of joint
    k alone, relative to that of as many copies of the best pose for it, and R² what a shift of another joint or a bump of the tool
    explains of it, or another place of the instrument, which is fitted with `refit`. Greedily, then by exchange.
    """
    choice = _Criterion.of(information, count, refit=refit)
    chosen: list[int] = []
    total = choice.start
    for _ in range(count):
        best = choice.best(total, chosen)
        chosen.append(best)
        total = total + choice.information[best]
    for _ in range(_SWEEPS):
        before = list(chosen)
        for place in range(count):
            total = total - choice.information[chosen[place]]
            chosen[place] = choice.best(total, [c for k, c in enumerate(chosen) if k != place])
            total = total + choice.information[chosen[place]]
        if chosen == before:
            break
    return np.array(chosen)


@dataclass(frozen=True, eq=False)
class PoseInformation:
    """Information (C, p, p) of every candidate on the shifts of `joints` joints, a bump of the whole tool (3), and the place of the
    instrument (6).
    """

    matrices: np.ndarray
    joints: int

    @classmethod
    def of(cls, model: RobotModel, candidates: Sequence[PoseSet]) -> PoseInformation:
        """That of candidates that are measured at several points, each a pose set of one point."""
        white = [WhitenedColumns.of(model, rows) for rows in candidates]
        return cls(np.sum([item.information for item in white], axis=0), white[0].joints)

    def deviations(self, chosen: np.ndarray, *, refit: bool) -> np.ndarray:
        """Standard deviations (J,) of shifts of single joints by the `chosen` candidates; large where a joint is not seen."""
        total = self.matrices[chosen].sum(axis=0) + _start(self.matrices)
        if refit:
            place = slice(self.joints + 3, None)
            total = total - _explained(total[None], slice(None), place)[0]
        single = np.diag(total)[: self.joints]
        return 1 / np.sqrt(np.maximum(single, 1e-30))


@dataclass(frozen=True, eq=False)
class WhitenedColumns:
    """Derivatives (C, 3, p) of a point at C candidates by the shifts of `joints` joints, a bump of the whole tool and the place of the
    instrument, in standard deviations of a reading.
    """

    columns: np.ndarray
    joints: int

    @classmethod
    def of(cls, model: RobotModel, rows: PoseSet) -> WhitenedColumns:
        """Those of one point."""
        errors = planned_errors(model, rows, compared="reference", placed=False)
        names = [f"{joint.name}.offset" for joint in model.motor_joints]
        joints = len(names)
        names += [f"tool.{key}" for key in GEOMETRY if key.startswith("length")]
        names += [f"station.{rows.station[0]}.{key}" for key in STATION]
        own = np.array([errors.own[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] for k in range(len(rows))])
        return cls(np.linalg.solve(np.linalg.cholesky(own), errors.at.jacobian(names)), joints)

    @property
    def information(self) -> np.ndarray:
        """Information (C, p, p)."""
        return np.swapaxes(self.columns, 1, 2) @ self.columns


def _start(information: np.ndarray) -> np.ndarray:
    return 1e-6 * np.diag(np.diag(information.mean(axis=0)) + 1e-12)


@dataclass(frozen=True, eq=False)
class _Criterion:
    """`information` (C, p, p) of every candidate on the shifts of J joints, then a bump of the tool (3), then the place of the instrument
    (6), which is fitted to the visit where it is `placed` anew; `seen` (J,) joints, and `least` (J,) variances of single shifts.
    """

    information: np.ndarray
    start: np.ndarray
    seen: np.ndarray
    least: np.ndarray
    placed: bool

    @classmethod
    def of(cls, information: PoseInformation, count: int, *, refit: bool) -> _Criterion:
        matrices, joints = information.matrices, range(information.joints)
        largest = matrices[:, joints, joints].max(axis=0)
        return cls(
            matrices,
            _start(matrices),
            largest > _FLOOR * largest.max(),
            1 / (count * np.maximum(largest, 1e-30)),
            refit,
        )

    def best(self, total: np.ndarray, taken: list[int]) -> int:
        """Candidate that is not `taken` with which the criterion is least, added to the information (p, p) of others."""
        joints = len(self.seen)
        bump, place = slice(joints, joints + 3), slice(joints + 3, None)
        whole = total + self.information
        by_place = _explained(whole, slice(0, joints + 3), place)
        if self.placed:
            whole = whole[:, : joints + 3, : joints + 3] - by_place
        single = np.maximum(whole[:, range(joints), range(joints)], 1e-12)
        rivals = [whole[:, :joints, :joints] ** 2 / (single[:, :, None] * single[:, None])]
        rivals[0][:, range(joints), range(joints)] = 0.0
        rivals.append(_diagonal(_explained(whole, slice(0, joints), bump))[:, :, None] / single[:, :, None])
        if not self.placed:
            rivals.append(_diagonal(by_place[:, :joints, :joints])[:, :, None] / single[:, :, None])
        share = np.concatenate([rivals[0][:, :, self.seen], *rivals[1:]], axis=2)
        confused = np.mean(1 / np.maximum(1 - share, _SAME), axis=2)
        relative = 1 / (single * self.least)
        score = np.sum((relative**2 * (1 + _APART * (confused - 1)))[:, self.seen], axis=1)
        score[taken] = np.inf
        return int(score.argmin())


def _explained(whole: np.ndarray, rows: slice, rival: slice) -> np.ndarray:
    """Part (C, r, r) of the information (C, p, p) on some parameters that others explain."""
    across = whole[:, rows, rival]
    return across @ np.linalg.solve(whole[:, rival, rival], np.swapaxes(across, 1, 2))


def _diagonal(matrices: np.ndarray) -> np.ndarray:
    return np.diagonal(matrices, axis1=1, axis2=2)
