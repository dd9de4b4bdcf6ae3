"""Errors at places of a fixture with sockets by the number of other places, and of poses in each socket, that a calibration has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.diagnostics.linearised_places import LinearisedPlaces
from flexcal.calibration.fit import GeometricFit, plausible_size
from flexcal.calibration.kinds import about_sockets, socket_numbers
from flexcal.units import MILLIMETRE

_SUBSETS = 4
"""Largest number of sets of other places that are tried for each place."""
_SHARES = (0.25, 0.5, 1.0)
"""Shares of the poses in each socket."""


@dataclass(frozen=True)
class LearningPoint:
    """Mean error `error`, m, at places that are left out of fits to `places` others with `poses` poses in each socket, on average."""

    places: int
    poses: float
    error: float


@dataclass(frozen=True)
class LearningCurve:
    """Errors by the number of places and by that of poses in a socket."""

    points: tuple[LearningPoint, ...]

    def document(self) -> list[dict[str, Any]]:
        """Block `learning_curve` of results.json."""
        return [
            {"places": p.places, "poses_per_socket": p.poses, "mean_mm": p.error / MILLIMETRE}
            for p in self.points
        ]

    @classmethod
    def of(cls, fit: GeometricFit) -> LearningCurve | None:
        """Curve of a fit with its terms, linearised at its solution; None with fewer than three places.

        Every place is left out of fits to 2, 3, … of the others, of which up to four sets are tried, evenly chosen, with a quarter, a half
        and all of their poses. What few places do not determine stays near its nominal value, within its plausible deviation.
        """
        places = fit.poses.fixtures
        if len(places) < 3 or fit.poses.socket is None or not fit.poses.in_socket.all():
            return None
        linear = LinearisedPlaces.of(fit)
        prior = _prior(linear)
        points = []
        for share in _SHARES:
            kept = {place: _some(linear, place, share) for place in places}
            sums = {place: linear.normal_equations(rows) for place, rows in kept.items()}
            visits = sum(len(set(fit.poses.socket[linear.rows_of(place)].tolist())) for place in places)
            poses = sum(len(rows) for rows in kept.values()) / visits
            for count in range(2, len(places)):
                errors = [
                    _error(linear, place, [sums[name] for name in chosen], prior)
                    for place in places
                    for chosen in _sets([name for name in places if name != place], count)
                ]
                points.append(LearningPoint(count, poses, float(np.mean(errors))))
        return cls(tuple(points))


def _prior(linear: LinearisedPlaces) -> tuple[np.ndarray, np.ndarray]:
    """Inverse variances (p,) of the parameters beforehand, about their nominal values, and the change (p,) to these."""
    fit = linear.fit
    fitted = fit.estimate.parameters.subset(linear.names)
    sizes = [
        1.0 if known else plausible_size(fit.model, name) / scale
        for name, known, scale in zip(linear.names, linear.known, linear.scale, strict=True)
    ]
    return 1 / np.square(sizes), (fitted.prior_mean() - fitted.coordinates()) / linear.scale


def _some(linear: LinearisedPlaces, place: str, share: float) -> np.ndarray:
    """Indices of a share of the poses in each socket of a place, evenly chosen."""
    own, sockets = linear.rows_of(place), linear.fit.poses.socket
    assert sockets is not None
    parts = []
    for socket in dict.fromkeys(sockets[own].tolist()):
        rows = own[sockets[own] == socket]
        count = max(round(share * len(rows)), 1)
        parts.append(rows[np.linspace(0, len(rows) - 1, count).round().astype(int)])
    return np.concatenate(parts)


def _sets(names: list[str], count: int) -> list[list[str]]:
    """Up to four sets of `count` names, each beginning elsewhere in their order and evenly spread over it."""
    if count == len(names):
        return [names]
    tries = min(_SUBSETS, len(names))
    starts = [len(names) * k // tries for k in range(tries)]
    return [[names[(start + len(names) * k // count) % len(names)] for k in range(count)] for start in starts]


def _error(
    linear: LinearisedPlaces,
    place: str,
    sums: list[tuple[np.ndarray, np.ndarray]],
    prior: tuple[np.ndarray, np.ndarray],
) -> float:
    """Mean distance, m, of the ball from its sockets at a place, predicted by a fit to others."""
    weight, nominal = prior
    matrix = np.sum([own for own, _ in sums], axis=0) + np.diag(weight)
    change = np.linalg.solve(matrix, np.sum([right for _, right in sums], axis=0) + weight * nominal)
    number = socket_numbers(linear.fit.poses)[linear.rows_of(place)]
    return float(np.linalg.norm(about_sockets(linear.ball(place, change), number), axis=1).mean())
