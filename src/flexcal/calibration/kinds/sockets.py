"""Sockets: a ball on the tool in the sockets of a fixture that stands anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from flexcal.calibration.kinds.kind import Kind, tilts_across
from flexcal.calibration.kinds.rigid_motions import best_motion, registered
from flexcal.data.poses import PoseSet
from flexcal.model.robot import SOCKET_SCALE, STATION, RobotModel

_FLAT = 0.01
"""Extent of sockets normal to a line, relative to that along it, below which they lie on the line."""


class Sockets(Kind):
    """Declared place of the socket in the fixture, whose pose is the station's. They tell lengths by their distances alone."""

    scale: ClassVar[str] = SOCKET_SCALE

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.in_socket

    def scale_std(self, model: RobotModel) -> float | None:
        """As `Kind.scale_std`."""
        declared = model.config.measurements.values()
        fixtures = [item for item in declared if item.kind == "sockets" and item.extent > 0]
        return fixtures[0].std / fixtures[0].extent if fixtures else None

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
