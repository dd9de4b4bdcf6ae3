"""Course of a change over visits: since when, and whether it came at once or grows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.calibration.error_model import SAME_COMMAND
from flexcal.calibration.recheck.change_effects import PossibleChange, possible_changes
from flexcal.calibration.recheck.global_test import ALIKE, FALSE_ALARM, chance_of_squares
from flexcal.calibration.recheck.visit_errors import VisitErrors, frame_turns
from flexcal.estimation import student_quantile

_PLACE = 0.1
"""Standard deviation, m and rad, of the place of an instrument that is set up anew: as good as unknown."""
_EARLIER = (1.0, 2.0, 4.0, 8.0)
"""Mean distances of visits by which a drift may have begun before the first visit, where nothing says from when it counts."""
_RANK = 1e-6


@dataclass(frozen=True, eq=False)
class VisitCourse:
    """One change over V visits.

    Attributes
    ----------
    change : PossibleChange
        What changed.
    kind : {"drift", "step"}
        In proportion to time, or at once.
    since : float
        Time at which the drift began, or of the first visit after the step.
    first : int
        Index of the first visit that it concerns.
    estimate, std : ndarray
        Change (k,) per unit of time of a drift, or that of a step, and standard deviations, in the units of the change.
    quantile : float
        Half-width of their 95 % intervals in standard deviations (Student).
    remainder : float
        Probability that chance leaves what the course does not explain: of all coordinates, or of the sizes of this change at the visits.
    score : float
        Twice the negative log-likelihood, with what Schwarz's criterion adds.
    """

    change: PossibleChange
    kind: Literal["drift", "step"]
    since: float
    first: int
    estimate: np.ndarray
    std: np.ndarray
    quantile: float
    remainder: float
    score: float


def visit_courses(
    visits: Sequence[VisitErrors], times: Sequence[float], origin: float | None
) -> tuple[VisitCourse, ...]:
    """Courses that explain the errors of all visits about equally well, by odds of 20, the best first; none where none does.

    Likelihood ratios of every single change by every course over the visits (Lorden 1971; Willsky and Jones 1976), from all coordinates of
    all visits at once. The error that the visits share, of the calibration or of the reference visit, is learnt from visit to visit
    (Kalman 1960), which makes innovations that are independent.

    `visits` are compared with the same thing, in their order at `times`; those that lack a pose of the last are left out. `origin` is the
    time of the reference visit, at which nothing had changed, None for a comparison with the calibration.
    """
    last = visits[-1]
    rows = [_rows(item, last) for item in visits]
    there = [k for k, found in enumerate(rows) if found is not None]
    if len(there) < 2:
        return ()
    seen = [_Aligned.of(visits[k], rows[k], last) for k in there]
    when = np.array([times[k] for k in there])
    changes = [c for c in possible_changes(last.model, last.at) if c.kind != "instrument_moved"]
    columns = np.hstack([change.columns for change in changes])
    scale = np.linalg.norm(columns, axis=0)
    courses = list(_courses(when, origin))
    values = np.stack([course for _, _, _, course in courses])
    whole, count, information, right = _filtered(seen, last.common, columns / scale, values)
    freedom = last.freedom
    kinds = [change.kind for change in changes]
    found, place = [], 0
    for change in changes:
        own = slice(place, place + len(change.names))
        place = own.stop
        free, free_rank = _free_gain(seen, last.common, columns[:, own] / scale[own])
        for k, (kind, since, first, _) in enumerate(courses):
            inverse, rank = _inverse(information[k, own, own])
            estimate = inverse @ right[k, own]
            gain = float(right[k, own] @ estimate)
            misfit = whole - gain
            uneven = chance_of_squares(max(free - gain, 0.0), max(free_rank - rank, 1), freedom)
            cost = (
                misfit if not np.isfinite(freedom) else (freedom + count) * float(np.log1p(misfit / freedom))
            )
            found.append(
                VisitCourse(
                    change,
                    kind,
                    since,
                    there[first],
                    estimate / scale[own],
                    np.sqrt(np.diag(inverse)) / scale[own],
                    student_quantile(0.975, freedom) if np.isfinite(freedom) else 1.96,
                    float(min(chance_of_squares(misfit, count - rank, freedom), uneven)),
                    cost + rank * float(np.log(count)) + 2 * float(np.log(kinds.count(change.kind))),
                )
            )
    fitting = sorted((item for item in found if item.remainder > FALSE_ALARM), key=lambda item: item.score)
    best: dict[tuple[str, str, str], VisitCourse] = {}
    for item in fitting:
        if item.score < fitting[0].score + ALIKE:
            best.setdefault((item.change.kind, item.change.subject, item.kind), item)
    return tuple(best.values())


def _courses(
    when: np.ndarray, origin: float | None
) -> Iterator[tuple[Literal["drift", "step"], float, int, np.ndarray]]:
    """Kind, time since when, first visit concerned, and the size (V,) of a unit of every course."""
    count = len(when)
    for k in range(count):
        yield "step", float(when[k]), k, (np.arange(count) >= k) * 1.0
    if origin is None:
        apart = (when[-1] - when[0]) / (count - 1)
        starts = [float(when[0] - share * apart) for share in _EARLIER]
    else:
        starts = [origin]
    for start in [*starts, *when[: count - 2].tolist()]:
        size = np.maximum(0.0, when - start)
        if size[-1] > size[-2] > 0:
            yield "drift", start, int(np.flatnonzero(size > 0)[0]), size


def _inverse(information: np.ndarray) -> tuple[np.ndarray, int]:
    """Pseudo-inverse of an information matrix, and its rank."""
    values, vectors = np.linalg.eigh(information)
    kept = values > _RANK * max(float(values[-1]), 1e-300)
    return (vectors[:, kept] / values[kept]) @ vectors[:, kept].T, int(kept.sum())


@dataclass(frozen=True, eq=False)
class _Aligned:
    """Errors (m,) and own covariance (m, m) of a visit at the poses of the last, in its axes; `unknown` coordinates are of the
    instrument's place.
    """

    errors: np.ndarray
    own: np.ndarray
    unknown: int

    @classmethod
    def of(cls, visit: VisitErrors, rows: np.ndarray | None, last: VisitErrors) -> _Aligned:
        assert rows is not None
        own = visit.own
        unknown = 0
        if visit.placed:
            place = np.hstack(
                [c.columns for c in possible_changes(visit.model, visit.at) if c.kind == "instrument_moved"]
            )
            own = own + _PLACE**2 * place @ place.T
            unknown = int(np.linalg.matrix_rank(place))
        every = (3 * rows[:, None] + np.arange(3)).ravel()
        turn = np.zeros((len(every), len(every)))
        for k, block in enumerate(frame_turns(last.model, visit.model, last.poses)):
            turn[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = block
        return cls(turn @ visit.errors[every], turn @ own[np.ix_(every, every)] @ turn.T, unknown)


def _rows(visit: VisitErrors, last: VisitErrors) -> np.ndarray | None:
    """Rows (K,) of a visit that are the poses and points of the last, None where one is missing."""
    found = []
    for q, target in zip(last.poses.q, last.poses.target, strict=True):
        near = np.abs(visit.poses.q - q).max(axis=1) < SAME_COMMAND
        rows = np.flatnonzero(near & (visit.poses.target == target))
        if not len(rows):
            return None
        found.append(int(rows[0]))
    return np.array(found)


def _filtered(
    visits: Sequence[_Aligned], common: np.ndarray, columns: np.ndarray, courses: np.ndarray
) -> tuple[float, int, np.ndarray, np.ndarray]:
    """Sum of squares of the innovations, their number, and of each of the G `courses` (G, V) the information (G, p, p) of all `columns`
    (m, p) and its right-hand side (G, p).
    """
    information = np.zeros((len(courses), columns.shape[1], columns.shape[1]))
    right = np.zeros((len(courses), columns.shape[1]))
    whole, count = 0.0, 0
    for visit, (white, scaled) in zip(visits, _innovations(visits, common, columns, courses), strict=True):
        whole += float(white @ white)
        count += len(white) - visit.unknown
        information += np.swapaxes(scaled, 1, 2) @ scaled
        right += np.swapaxes(scaled, 1, 2) @ white
    return whole, count, information, right


def _free_gain(visits: Sequence[_Aligned], common: np.ndarray, columns: np.ndarray) -> tuple[float, int]:
    """Sum of squares that one change explains with a size of its own at every visit, and the number of these."""
    pairs = list(_innovations(visits, common, columns, np.eye(len(visits))))
    effects = np.concatenate([np.hstack(list(scaled)) for _, scaled in pairs])
    values = np.concatenate([white for white, _ in pairs])
    inverse, rank = _inverse(effects.T @ effects)
    right = effects.T @ values
    return float(right @ inverse @ right), rank


def _innovations(
    visits: Sequence[_Aligned], common: np.ndarray, columns: np.ndarray, courses: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Whitened innovations (m,) of every visit, and (G, m, p) what each course of every column makes in them."""
    mean, covariance = np.zeros(len(common)), common
    expected = np.zeros((len(courses), *columns.shape))
    for k, visit in enumerate(visits):
        inverse = np.linalg.inv(np.linalg.cholesky(covariance + visit.own))
        white = inverse @ (visit.errors - mean)
        scaled = inverse @ (courses[:, k, None, None] * columns - expected)
        yield white, scaled
        gain = covariance @ inverse.T
        mean = mean + gain @ white
        expected = expected + gain @ scaled
        covariance = covariance - gain @ gain.T
