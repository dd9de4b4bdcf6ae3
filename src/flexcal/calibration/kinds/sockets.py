"""Sockets: a ball on the tool in the sockets of a fixture that stands anywhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from flexcal.calibration.kinds.kind import Kind, tilts_across
from flexcal.calibration.kinds.rigid_motions import best_motion, registered
from flexcal.data.poses import PoseSet
from flexcal.model.robot import STATION, RobotModel, socket_scale

_OWN = "sockets."
_FLAT = 0.01
"""Extent of sockets normal to a line, relative to that along it, below which they lie on the line."""


class Sockets(Kind):
    """Declared place of the socket in the fixture, whose pose is the station's. They tell lengths by their distances alone."""

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.in_socket

    def owns(self, name: str) -> bool:
        """As `Kind.owns`."""
        return name.startswith(_OWN)

    def scales(self, poses: PoseSet) -> dict[str, np.ndarray]:
        """As `Kind.scales`: one a fixture."""
        return {socket_scale(name): poses.in_socket & (poses.holder == name) for name in poses.holders}

    def scale_std(self, model: RobotModel, name: str) -> float | None:
        """As `Kind.scale_std`."""
        for fixture, item in model.config.measurements.items():
            if item.kind == "sockets" and name == socket_scale(fixture) and item.extent > 0:
                return item.std / item.extent
        return None

    def start(
        self, model: RobotModel, station: str, targets: np.ndarray, readings: np.ndarray
    ) -> dict[str, float]:
        """As `Kind.start`."""
        return registered(station, targets, readings, best_motion)

    def place(self, model: RobotModel, poses: PoseSet, station: str, *, turned: bool) -> Sequence[str]:
        """As `Kind.place`: no rotation of a fixture with one socket, two of one whose sockets lie on a line."""
        if not turned:
            return STATION[:3]
        places = np.unique(poses.position[poses.station == station], axis=0)
        _, sizes, axes = np.linalg.svd(places - places.mean(axis=0))
        if len(places) == 1 or sizes[0] == 0:
            return STATION[:3]
        if len(places) > 2 and sizes[1] > _FLAT * sizes[0]:
            return STATION
        return (*STATION[:3], *tilts_across(model, station, axes[0]))

    def tells_lengths(self, poses: PoseSet) -> bool:
        """As `Kind.tells_lengths`."""
        return any(
            len(np.unique(poses.position[poses.in_socket & (poses.station == name)], axis=0)) > 1
            for name in poses.fixtures
        )


def socket_numbers(poses: PoseSet) -> np.ndarray:
    """Numbers (N,) from 0 of the sockets that held the ball, each at one place of its fixture; -1 for other rows."""
    numbers, held = np.full(len(poses), -1), poses.in_socket
    if held.any() and poses.socket is not None:
        place, socket = (
            np.unique(names[held], return_inverse=True)[1] for names in (poses.station, poses.socket)
        )
        numbers[held] = np.unique(place * len(poses) + socket, return_inverse=True)[1]
    return numbers


def about_sockets(values: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Deviations of values (N, …) from the means over rows of equal `number` (N,), one of a negative number being left as it is.

    Nobody knows where a socket is: of the contacts of the ball with it only these deviations are errors.
    """
    result = values.copy()
    for one in np.unique(number[number >= 0]):
        result[number == one] -= values[number == one].mean(axis=0)
    return result


@dataclass(frozen=True)
class DeclaredDistance:
    """Declared `distance`, m, of two `sockets` of the fixture `holder` at one of its places; `numbers` as in `socket_numbers`."""

    place: str
    sockets: tuple[str, str]
    holder: str
    numbers: tuple[int, int]
    distance: float

    def between(self, ball: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Vector (3,) m from the first to the second socket, each the mean of the positions `ball` (N, 3) in it."""
        first, second = (ball[number == one].mean(axis=0) for one in self.numbers)
        return second - first


def declared_distances(poses: PoseSet) -> Iterator[DeclaredDistance]:
    """Distances between all sockets of a fixture at every one of its places."""
    if poses.socket is None or poses.holder is None:
        return
    number = socket_numbers(poses)
    for place in poses.fixtures:
        here = np.flatnonzero(poses.in_socket & (poses.station == place))
        rows = here[np.sort(np.unique(number[here], return_index=True)[1])]
        for i, k in combinations(rows.tolist(), 2):
            yield DeclaredDistance(
                place,
                (str(poses.socket[i]), str(poses.socket[k])),
                str(poses.holder[i]),
                (int(number[i]), int(number[k])),
                float(np.linalg.norm(poses.position[k] - poses.position[i])),
            )
