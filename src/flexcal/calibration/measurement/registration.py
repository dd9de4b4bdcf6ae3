"""Registration of the instrument's frame with the robot's base before parameters are fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.measurement.prediction import predict_measurements
from flexcal.calibration.measurement.station_start import start_of_station
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.parts import rotation_vector, wxyz_rotation
from flexcal.model.robot import RobotModel

FOREIGN = np.deg2rad(15)
"""Median angle, rad, between measured and nominal orientations above which they follow another convention."""
ALREADY_ALIGNED = 0.010
"""Median distance, m, between nominal and measured points below which instrument and base frame are the same."""


def register(model: RobotModel, poses: PoseSet, predicted: np.ndarray) -> RobotModel:
    """Register every station of `poses` by the rigid motion that best maps `predicted` (N, 3) to the measured points (Kabsch).

    Instruments of distances and touched faces are placed by `start_of_station`. A station whose points already agree to a centimetre is
    left at the base frame. The rotation of the first station stays where it is put here, for the first joint's errors span it; the rest is
    refined by the fit. Raises `FlexcalError` for a station that robot.yaml does not know, or with fewer than three poses that do not lie
    on a line.
    """
    values: dict[str, float] = {}
    for station in poses.stations:
        model.station_index(station)
        own = poses.station == station
        measured, expected = poses.position[own], predicted[own]
        if poses.kind is not None and (kind := str(poses.kind[own][0])):
            start = start_of_station(kind, station, expected, measured)
            values |= {f"station.{station}.{key}": value for key, value in start.items()}
            continue
        if np.median(np.linalg.norm(measured - expected, axis=1)) < ALREADY_ALIGNED:
            rotation, offset = np.eye(3), np.zeros(3)
        else:
            known = station in poses.fixtures
            rotation, offset = (best_motion if known else rigid_motion)(expected, measured, station)
        turn = rotation_vector(rotation)
        values |= {
            f"station.{station}.{key}": float(v) for key, v in zip(("x", "y", "z"), offset, strict=True)
        }
        values |= {f"station.{station}.r{key}": float(v) for key, v in zip("xyz", turn, strict=True)}
    return model.with_values(values)


def with_target_axes(model: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot with the axes of every target whose orientation was measured, as the registered stations of `model` see them on average."""
    if poses.quaternion_wxyz is None or not poses.turned.any():
        return model
    own = poses.subset(poses.turned)
    bare = replace(
        model, geometry=replace(model.geometry, point_turn=np.zeros_like(model.geometry.point_turn))
    )
    predicted = predict_measurements(bare, own, elastic=False).orientation
    between = np.matmul(np.swapaxes(predicted, 1, 2), wxyz_rotation(poses.quaternion_wxyz[poses.turned]))
    values = {}
    for target in own.targets:
        left, _, right = np.linalg.svd(between[own.target == target].sum(axis=0))
        mean = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        turn = rotation_vector(mean)
        values |= {f"point.{target}.r{key}": float(v) for key, v in zip("xyz", turn, strict=True)}
    return model.with_values(values)


def require_orientations(model: RobotModel, poses: PoseSet) -> None:
    """Raise `FlexcalError` where the measured orientations are far from those of the registered `model`, whose targets' axes are placed."""
    if not poses.turned.any():
        return
    own = poses.subset(poses.turned)
    angles = np.linalg.norm(predict_measurements(model, own, elastic=False).residual[len(own) :], axis=1)
    if (angle := float(np.median(angles))) > FOREIGN:
        raise FlexcalError(
            "E-CAL-012",
            f"the measured orientations differ from the robot's by {np.rad2deg(angle):.0f}° (median) however the target is turned on "
            "the tool; qw, qx, qy, qz must turn its axes into the instrument's: 'flexcal import' tells the convention of a file.",
        )


def rigid_motion(source: np.ndarray, target: np.ndarray, name: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Rigid motion that maps points onto others with the least sum of squared distances (Kabsch 1976).

    Parameters
    ----------
    source, target : ndarray
        Corresponding points (N, 3), m.
    name : str
        What the points are, for the message of the error.

    Returns
    -------
    rotation : ndarray
        Rotation matrix (3, 3).
    translation : ndarray
        Translation (3,), m: ``target ≈ source @ rotation.T + translation``.

    Raises
    ------
    FlexcalError
        Where the points do not span a plane.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import rigid_motion
    >>> source = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> rotation, translation = rigid_motion(source, source + [1, 2, 3])
    >>> np.allclose(rotation, np.eye(3))
    True
    >>> translation.round(6)
    array([1., 2., 3.])
    """
    left, sizes, right = _correlation(source, target, name)
    if sizes[1] < 1e-9 * max(sizes[0], 1e-12):
        raise FlexcalError(
            "E-CAL-016", f"the points of station '{name}' lie on a line; measure poses distributed in space."
        )
    return _motion(source, target, left, right)


def best_motion(source: np.ndarray, target: np.ndarray, name: str = "") -> tuple[np.ndarray, np.ndarray]:
    """One of the rigid motions of `rigid_motion` for points (N, 3) that may lie on a line, or in one place, as sockets of a fixture do.

    Raises `FlexcalError` for fewer than three points.
    """
    left, _, right = _correlation(source, target, name)
    return _motion(source, target, left, right)


def _correlation(
    source: np.ndarray, target: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if len(source) < 3:
        raise FlexcalError(
            "E-CAL-015", f"station '{name}' has {len(source)} poses; at least 3 are needed to register it."
        )
    return np.linalg.svd((target - target.mean(axis=0)).T @ (source - source.mean(axis=0)))


def _motion(
    source: np.ndarray, target: np.ndarray, left: np.ndarray, right: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    from_centre, to_centre = source.mean(axis=0), target.mean(axis=0)
    sign = np.sign(np.linalg.det(left @ right))
    rotation = left @ np.diag([1.0, 1.0, sign]) @ right
    return rotation, to_centre - rotation @ from_centre
