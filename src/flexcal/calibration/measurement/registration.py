"""Registration of the instrument's frame with the robot's base before parameters are fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.kinds import ANGULAR, kind_of
from flexcal.calibration.measurement.prediction import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.parts import wxyz_rotation
from flexcal.model.robot import RobotModel

FOREIGN = np.deg2rad(15)
"""Median angle, rad, between measured and nominal orientations above which they follow another convention."""
_MANY, _CENTRES, _LISTED = 0.3, 200, 10
"""Share of the orientations that follow one convention from which it is that of the file; how many are compared with all, and listed."""


def register(model: RobotModel, poses: PoseSet, predicted: np.ndarray) -> RobotModel:
    """Register every station of `poses` by the rigid motion that best maps `predicted` (N, 3) to the measured points (Kabsch).

    Other instruments are placed as their `Kind.start` says. A station whose points already agree to a centimetre is left at the base
    frame. The rotation of the first station stays where it is put here, for the first joint's errors span it; the rest is
    refined by the fit. Raises `FlexcalError` for a station that robot.yaml does not know, or with fewer than three poses that do not lie
    on a line.
    """
    values: dict[str, float] = {}
    for station in poses.stations:
        model.station_index(station)
        own = poses.station == station
        start = kind_of(poses, station).start(model, station, predicted[own], poses.position[own])
        values |= {f"station.{station}.{key}": value for key, value in start.items()}
    return model.with_values(values)


def with_target_axes(model: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot with the axes of every target whose orientation was measured, as the registered stations of `model` see them on average."""
    if not poses.angled.any():
        return model
    geometry = model.geometry
    bare = replace(
        model,
        geometry=replace(
            geometry,
            point_turn=np.zeros_like(geometry.point_turn),
            point_zero=np.zeros_like(geometry.point_zero),
        ),
    )
    at, values = predict_measurements(bare, poses, elastic=False), {}
    for kind in ANGULAR:
        for target in dict.fromkeys(poses.target[kind.rows(poses)].tolist()):
            numbers = kind.target_start(at, target)
            values |= {f"point.{target}.{key}": value for key, value in numbers.items()}
    return model.with_values(values)


def require_orientations(model: RobotModel, poses: PoseSet) -> None:
    """Raise `FlexcalError` where the orientations that an instrument or a camera measured are far from those of the registered `model`,
    whose targets' axes are placed.
    """
    if not poses.turned.any():
        return
    own = poses.subset(poses.turned)
    angles = np.linalg.norm(predict_measurements(model, own, elastic=False).residual[len(own) :], axis=1)
    for camera in dict.fromkeys([] if own.camera is None else own.camera[own.seen].tolist()):
        off = float(np.median(angles[own.camera == camera]))
        if off > FOREIGN:
            raise FlexcalError(
                "E-CAL-028",
                f"the views of {camera} turn otherwise than the robot, by {np.rad2deg(off):.0f}° (median), however camera and board are "
                "mounted: check the order and units of the joint positions, whether each belongs to its image, and whether the images are "
                "mirrored.",
            )
    if (angle := float(np.median(angles))) > FOREIGN:
        agreeing = _agreeing(model, own)
        if agreeing.mean() > _MANY:
            other = own.pose[~agreeing]
            listed = ", ".join(map(str, other[:_LISTED].tolist())) + (" …" if len(other) > _LISTED else "")
            raise FlexcalError(
                "E-CAL-024",
                f"{agreeing.sum()} of {len(own)} orientations agree with each other, and the others, of pose {listed}, follow another "
                "convention: give all rows of qw, qx, qy, qz the same order of components, the same direction and the same axes.",
            )
        raise FlexcalError(
            "E-CAL-012",
            f"the measured orientations differ from the robot's by {np.rad2deg(angle):.0f}° (median) however the target is turned on "
            "the tool; qw, qx, qy, qz must turn its axes into the instrument's: 'flexcal import' tells the convention of a file.",
        )


def _agreeing(model: RobotModel, poses: PoseSet) -> np.ndarray:
    """Rows (N,) of the largest set of orientations that turn the target in the same way on the tool, to 15°."""
    quaternion = poses.quaternion_wxyz
    assert quaternion is not None
    predicted = predict_measurements(model, poses, elastic=False).orientation
    mounted = np.matmul(np.swapaxes(predicted, 1, 2), wxyz_rotation(quaternion)).reshape(len(poses), 9)
    centres = mounted[np.linspace(0, len(poses) - 1, min(len(poses), _CENTRES)).astype(int)]
    near = centres @ mounted.T > 1 + 2 * np.cos(FOREIGN)
    return near[np.argmax(near.sum(axis=1))]
