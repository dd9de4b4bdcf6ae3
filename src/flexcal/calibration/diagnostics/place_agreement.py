"""Agreement of the places of a fixture with sockets: each compared with the robot fitted to all others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from flexcal.calibration.diagnostics.linearised_places import LinearisedPlaces
from flexcal.calibration.fit import GeometricFit
from flexcal.data.poses import PoseSet
from flexcal.estimation import f_tail
from flexcal.units import MILLIMETRE

FEWEST_PLACES = 4
"""Least number of places at which one that disagrees can be told from the others."""
_CHANCE = 0.01
"""Probability of naming a place where all agree."""
_TWICE = 2.0
"""Ratio of squared errors from which places are not consistent; lower ones are common, as no model of a robot is exact."""
_KINDS = 3
"""Number of quantities by which places are compared."""

SocketPair = tuple[str, str]
Finding = Literal["error", "outliers", "distance"]


@dataclass(frozen=True)
class PlaceErrors:
    """Errors at one place of a fixture, predicted without its own rows.

    `error` and `typical` are the mean and the median distance, m, of the ball from its mean position in each socket; `outliers` the number
    of its `poses` that the robust loss gave a small weight; `distances` the found minus the declared distance of each pair of sockets, m;
    `ratio` the squared errors that its rows add to the fit over those expected from the others' scatter, F-distributed with `p` beyond it
    (Chow's predictive test, 1960).
    """

    name: str
    poses: int
    error: float
    typical: float
    outliers: int
    distances: Mapping[SocketPair, float]
    ratio: float
    p: float


@dataclass(frozen=True)
class Disagreement:
    """A place that differs from the others by more than chance: in `what`, at which `pair` of sockets, with the p-value of all places."""

    place: str
    what: Finding
    p: float
    pair: SocketPair | None = None


@dataclass(frozen=True)
class PlaceAgreement:
    """Errors at every place, left out of a linearised fit in turn, and the places that disagree with the others."""

    places: tuple[PlaceErrors, ...]
    disagreements: tuple[Disagreement, ...]

    @property
    def judged(self) -> bool:
        """Whether there are enough places to tell which of them disagrees."""
        return len(self.places) >= FEWEST_PLACES

    @property
    def inconsistent(self) -> PlaceErrors | None:
        """Where places are too few to judge, one with twice the squared errors that the others let expect (significantly); else None."""
        if self.judged:
            return None
        worst = min(self.places, key=lambda place: place.p)
        return worst if worst.ratio > _TWICE and len(self.places) * worst.p < _CHANCE else None

    @property
    def suspects(self) -> tuple[str, ...]:
        """Names of the places that disagree."""
        return tuple(dict.fromkeys(item.place for item in self.disagreements))

    def document(self) -> dict[str, Any]:
        """Block `places` of results.json."""
        return {
            "judged": self.judged,
            "inconsistent": None if self.inconsistent is None else self.inconsistent.name,
            "places": {
                place.name: {
                    "poses": place.poses,
                    "mean_mm": place.error / MILLIMETRE,
                    "median_mm": place.typical / MILLIMETRE,
                    "outliers": place.outliers,
                    "ratio": place.ratio,
                    "p": place.p,
                    "distances_mm": {
                        f"{a} to {b}": off / MILLIMETRE for (a, b), off in place.distances.items()
                    },
                }
                for place in self.places
            },
            "disagree": [
                {
                    "place": item.place,
                    "what": item.what,
                    "sockets": None if item.pair is None else list(item.pair),
                    "p": item.p,
                }
                for item in self.disagreements
            ],
        }

    @classmethod
    def of(cls, fit: GeometricFit) -> PlaceAgreement | None:
        """Agreement of the places of a fit; None with fewer than two places.

        Three quantities of a place are compared with those of the others, at 1 % together for all places. The logarithm of the median
        error and the distances of the sockets, by Student's t with the standard deviation of the others, so that places may differ as much
        as these do; several that disagree are found together (Rosner 1983). The number of outliers, by Fisher's exact test.
        """
        places = place_errors(fit)
        if len(places) < 2:
            return None
        return cls(places, _disagreements(places) if len(places) >= FEWEST_PLACES else ())


def place_errors(fit: GeometricFit) -> tuple[PlaceErrors, ...]:
    """Errors at every place of a fixture, with the other places and all points of instruments in the fit linearised at its solution.

    Outliers do not count in the fit. Stiffness and inertia keep their estimates, as the error model does.
    """
    poses, result = fit.poses, []
    if not poses.fixtures:
        return ()
    linear = LinearisedPlaces.of(fit)
    _, whole, freedom = linear.solved(linear.inside)
    inside = ~np.isin(np.arange(len(poses)), fit.estimate.outliers)
    for fixture in poses.fixtures:
        own = linear.rows_of(fixture)
        change, others, degrees = linear.solved(linear.inside & ~np.isin(linear.row, own))
        ball = linear.ball(fixture, change)
        added = max(freedom - degrees, 1)
        ratio = max(whole - others, 0.0) / added * degrees / others if degrees > 0 and others > 0 else 0.0
        p = f_tail(added, max(degrees, 1), float(ratio))
        result.append(_errors(poses.subset(own), ball, inside[own], ratio, p, several=len(poses.holders) > 1))
    return tuple(result)


def _errors(
    poses: PoseSet, ball: np.ndarray, inside: np.ndarray, ratio: float, p: float, *, several: bool
) -> PlaceErrors:
    """Errors at one place: `ball` (N, 3) m are the predicted positions in the fixture, `inside` (N,) the rows that are no outliers.

    With `several` fixtures the sockets have their fixture's name too, for distances of different fixtures are not compared.
    """
    centres, off = {}, np.empty(len(poses))
    assert poses.socket is not None
    for socket in dict.fromkeys(poses.socket.tolist()):
        rows = poses.socket == socket
        good = rows & inside if (rows & inside).any() else rows
        centre = ball[good].mean(axis=0)
        off[rows] = np.linalg.norm(ball[rows] - centre, axis=1)
        centres[socket] = centre, poses.position[np.argmax(rows)]
    prefix = f"{poses.holders[0]} " if several else ""
    distances = {
        (prefix + a, prefix + b): float(
            np.linalg.norm(centres[a][0] - centres[b][0]) - np.linalg.norm(centres[a][1] - centres[b][1])
        )
        for a, b in combinations(sorted(centres), 2)
    }
    name, outliers = str(poses.station[0]), int((~inside).sum())
    return PlaceErrors(
        name, len(poses), float(off.mean()), float(np.median(off)), outliers, distances, ratio, p
    )


def _disagreements(places: Sequence[PlaceErrors]) -> tuple[Disagreement, ...]:
    """Places that differ from the others, the most certain first."""
    found = [
        *_larger({place.name: float(np.log(place.typical)) for place in places}, "error", either=False),
        *_more_outliers(places),
    ]
    for pair in dict.fromkeys(pair for place in places for pair in place.distances):
        known = {place.name: place.distances[pair] for place in places if pair in place.distances}
        found += [replace(item, pair=pair) for item in _larger(known, "distance", either=True)]
    return tuple(sorted(found, key=lambda item: item.p))


def _larger(values: Mapping[str, float], what: Finding, *, either: bool) -> list[Disagreement]:
    """Places whose value is larger than those of the others, or with `either` farther from them to either side.

    The generalised extreme Studentised deviate (Rosner 1983): the farthest place is taken out again and again, and all that were taken
    out up to the last significant one disagree. They are less than half of the places.
    """
    from scipy.special import stdtr

    left, taken = dict(values), []
    while len(left) >= FEWEST_PLACES and len(taken) < (len(values) - 1) // 2:
        numbers = np.array(list(left.values()))
        deviations = np.abs(numbers - numbers.mean()) if either else numbers - numbers.mean()
        own = int(np.argmax(deviations))
        others = np.delete(numbers, own)
        spread = float(others.std(ddof=1)) * np.sqrt(1 + 1 / len(others))
        distance = abs(numbers[own] - others.mean())
        tail = float(stdtr(len(others) - 1, -distance / spread)) if spread > 0 else float(distance == 0)
        name = list(left)[own]
        taken.append(Disagreement(name, what, min(1.0, (2 if either else 1) * len(left) * tail)))
        del left[name]
    certain = [k for k, item in enumerate(taken) if item.p < _CHANCE / _KINDS]
    last = max(certain, default=-1)
    return [
        replace(item, p=min(i.p for i in taken[k : last + 1])) for k, item in enumerate(taken[: last + 1])
    ]


def hypergeometric_tail(found: int, rows: int, marked: int, drawn: int) -> float:
    """Probability of `found` or more of the `marked` ones among `drawn` of all `rows`."""
    from scipy.special import gammaln

    def choices(whole: np.ndarray, part: np.ndarray) -> np.ndarray:
        return gammaln(whole + 1.0) - gammaln(part + 1.0) - gammaln(whole - part + 1.0)

    counts = np.arange(max(found, drawn - (rows - marked), 0), min(marked, drawn) + 1)
    logarithms = (
        choices(np.array(marked), counts)
        + choices(np.array(rows - marked), drawn - counts)
        - choices(np.array(rows), np.array(drawn))
    )
    return float(np.exp(logarithms).sum())


def _more_outliers(places: Sequence[PlaceErrors]) -> list[Disagreement]:
    """Places with more outliers than the others, by Fisher's exact test."""
    rows, outliers = sum(place.poses for place in places), sum(place.outliers for place in places)
    found = []
    for place in places:
        tail = hypergeometric_tail(place.outliers, rows, outliers, place.poses)
        found.append(Disagreement(place.name, "outliers", min(1.0, len(places) * tail)))
    return [item for item in found if item.p < _CHANCE / _KINDS]
