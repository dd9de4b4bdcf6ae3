"""Lines: contact with a straight edge or a bore that lies anywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.calibration.kinds.kind import Kind, tilts_across
from flexcal.calibration.kinds.robust_start import (
    PASSES,
    cauchy_weights,
    principal_directions,
    require_fitting,
    require_targets,
    station_along,
)
from flexcal.data.poses import LINE, PoseSet
from flexcal.model.robot import RobotModel


class Lines(Kind):
    """Distances along x and y from the z axis of the station. They never tell lengths, nor where on the line a contact was."""

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.of_kind(LINE)

    def read(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.read`."""
        return located * [1.0, 1.0, 0.0]

    def slopes(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.slopes`."""
        return np.broadcast_to(np.diag([1.0, 1.0, 0.0]), (len(located), 3, 3))

    def start(
        self, model: RobotModel, station: str, targets: np.ndarray, readings: np.ndarray
    ) -> dict[str, float]:
        """As `Kind.start`."""
        require_targets(station, targets, 4)
        direction, through, misfit = _line(targets)
        require_fitting(model, station, misfit, targets)
        return station_along(direction, through)

    def place(self, model: RobotModel, poses: PoseSet, station: str, *, turned: bool) -> Sequence[str]:
        """As `Kind.place`: a rotation about the line, and a motion along it, change nothing."""
        return ("x", "y", *tilts_across(model, station, np.array([0.0, 0.0, 1.0])))

    def tells_lengths(self, poses: PoseSet) -> bool:
        """As `Kind.tells_lengths`."""
        return False


def _line(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direction (3,) of a line, a point (3,) on it, and the distances (N,) of the points from it."""
    direction, through, misfit = np.zeros(3), points.mean(axis=0), np.zeros(len(points))
    for _ in range(PASSES):
        weights = cauchy_weights(misfit)
        through = np.average(points, axis=0, weights=weights)
        direction = principal_directions(points, weights)[0]
        away = points - through
        misfit = np.linalg.norm(away - np.outer(away @ direction, direction), axis=1)
    return direction, through, misfit
