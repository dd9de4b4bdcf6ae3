"""Planes: contact with a plane that lies anywhere, or its distance as a dial gauge reads it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.calibration.kinds.kind import Kind, tilts_across
from flexcal.calibration.kinds.robust_start import (
    FLAT,
    PASSES,
    cauchy_weights,
    principal_directions,
    require_fitting,
    require_targets,
    station_along,
)
from flexcal.data.poses import PLANE, PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel


class Planes(Kind):
    """Height above the plane z = 0 of the station. They never tell lengths, nor the plane's rotation about its normal."""

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.of_kind(PLANE)

    def read(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.read`."""
        return located * [0.0, 0.0, 1.0]

    def slopes(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.slopes`."""
        return np.broadcast_to(np.diag([0.0, 0.0, 1.0]), (len(located), 3, 3))

    def start(
        self, model: RobotModel, station: str, targets: np.ndarray, readings: np.ndarray
    ) -> dict[str, float]:
        """As `Kind.start`."""
        require_targets(station, targets, 4)
        extents = np.linalg.svd(targets - np.median(targets, axis=0), compute_uv=False)
        if extents[1] < FLAT * extents[0]:
            raise FlexcalError(
                "E-CAL-022",
                f"the points touched on '{station}' lie on a line; touch the plane where it is wide.",
            )
        normal, through, misfit = _plane(targets, readings[:, 2])
        require_fitting(model, station, misfit, targets)
        return station_along(normal, through)

    def place(self, model: RobotModel, poses: PoseSet, station: str, *, turned: bool) -> Sequence[str]:
        """As `Kind.place`: motions in the plane change nothing."""
        return ("z", *tilts_across(model, station, np.array([0.0, 0.0, 1.0])))

    def tells_lengths(self, poses: PoseSet) -> bool:
        """As `Kind.tells_lengths`."""
        return False


def _plane(points: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal (3,) of the plane from which points are at the distances `readings`, a point (3,) in it, and the misfit (N,).

    The normal has a positive largest coordinate where the readings do not tell its sign.
    """
    first = principal_directions(points, np.ones(len(points)))[2]
    first = first * np.sign(first[np.argmax(np.abs(first))])
    fits = [_plane_about(points, readings, sign * first) for sign in (1.0, -1.0)]
    return min(fits, key=lambda fit: float(np.median(np.abs(fit[2]))))


def _plane_about(
    points: np.ndarray, readings: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `_plane`, with a normal on the side of a given one."""
    through = (points - readings[:, None] * normal).mean(axis=0)
    misfit = np.zeros(len(points))
    for _ in range(PASSES):
        inside, weights = points - readings[:, None] * normal, cauchy_weights(misfit)
        found = principal_directions(inside, weights)[2]
        normal = found if found @ normal > 0 else -found
        through = np.average(inside, axis=0, weights=weights)
        misfit = (points - through) @ normal - readings
    return normal, through, misfit
