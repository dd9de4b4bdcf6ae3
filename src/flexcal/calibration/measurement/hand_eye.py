"""Start of cameras in closed form: robot-world and hand-eye rotations from all views together, and the motions that these need."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.measurement.prediction import predict_measurements
from flexcal.data.camera import Lens
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import joint_ranges, point_kinematics
from flexcal.model.parts import rotation_vector, wxyz_rotation
from flexcal.model.robot import STATION, RobotModel
from flexcal.units import MILLIMETRE

_LEAST_TURN = np.deg2rad(2)
"""Rotation of the hand, rad, root mean square about an axis, below which the views hardly tell where the camera is on it."""
_ABLE = np.deg2rad(10)
"""Rotation, rad, of random postures below which a robot cannot turn its hand about an axis, as a SCARA."""
_LEAST_FOCAL = 0.02
"""Relative standard deviation of the focal length above which distances from the board are no measurement."""
_POSTURES, _PASSES, _ROUNDS = 200, 10, 3
_FOREIGN, _LEAST_LIMIT = 5.0, np.deg2rad(1)
"""Misfit of a view in medians, and rad, above which it does not count for the start."""

_FAR, _CLEARLY = 0.005, 1 / 3
"""Misfit, m, of places, and its ratio to that of mirrored ones, from which views are mirrored: their orientations fit either way."""


def with_camera_places(model: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot with the places of boards, and of cameras in the cell, from the orientations of all views together.

    Robot-world and hand-eye rotations of the most of its views are found together, in closed form (Shah 2013), then refined by
    turns, each from all views; the places follow by linear least squares with that of the target on the hand, of which nothing need be
    known. Sums over the views, so their order and the signs of quaternions do not matter. Raises `FlexcalError` for views between which
    the hand does not turn about two axes, where the robot could turn it, for mirrored ones, and for those that do not tell the focal
    length.
    """
    values: dict[str, float] = {}
    for station in poses.boards:
        rows = poses.subset(np.flatnonzero(poses.seen & poses.turned & (poses.station == station)))
        for target in rows.targets[:1]:
            values |= _place(model, station, target, rows.subset(rows.target == target))
    for name, lens in poses.lenses.items():
        _require_focal_length(name, lens)
    return model.with_values(values)


def _require_focal_length(name: str, lens: Lens) -> None:
    """Raise `FlexcalError` where the views of a camera do not tell its focal length."""
    share = float(np.sqrt(lens.covariance[0, 0])) / lens.values[0]
    if share > _LEAST_FOCAL:
        raise FlexcalError(
            "E-CAL-027",
            f"the views of the camera {name} tell its focal length to {share:.0%} only, as where the image is always parallel "
            "to the board; tilt camera or board by 20° to 45° against each other, in several directions.",
        )


def _place(model: RobotModel, station: str, target: str, poses: PoseSet) -> dict[str, float]:
    assert poses.quaternion_wxyz is not None
    at = predict_measurements(model, poses, elastic=False).kinematics
    axes, point = at.orientation, at.position
    if not _turns_enough(model, station, target, axes):
        return {}
    measured = wxyz_rotation(poses.quaternion_wxyz)
    world, misfit = _trimmed_robot_world(axes, measured)
    own = misfit <= max(_FOREIGN * float(np.median(misfit)), _LEAST_LIMIT)
    offset, away = _offset(world, axes[own], point[own], poses.position[own])
    mirrored = _offset(world, axes[own], point[own], -poses.position[own])[1]
    if away > _FAR and mirrored < _CLEARLY * away:
        raise FlexcalError(
            "E-CAL-029",
            f"the views of '{station}' are mirrored: places of the camera before the board fit those of the robot to "
            f"{mirrored / MILLIMETRE:.0f} mm (median) in a mirror, else to {away / MILLIMETRE:.0f} mm; take images that are not flipped, "
            "and number the corners as they are read.",
        )
    numbers = zip(STATION, (*offset, *rotation_vector(world)), strict=True)
    return {f"station.{station}.{key}": float(value) for key, value in numbers}


def _offset(
    world: np.ndarray, axes: np.ndarray, point: np.ndarray, seen: np.ndarray
) -> tuple[np.ndarray, float]:
    """Place (3,) of the base, with that of the target on the hand, by linear least squares, and the median distance, m, that is left."""
    turned = world @ axes
    columns = np.concatenate([turned, np.broadcast_to(np.eye(3), axes.shape)], axis=2).reshape(-1, 6)
    away = (seen - point @ world.T).ravel()
    solution = np.linalg.lstsq(columns, away, rcond=None)[0]
    left = (away - columns @ solution).reshape(-1, 3)
    return solution[3:], float(np.median(np.linalg.norm(left, axis=1)))


def _trimmed_robot_world(axes: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation Z (3, 3) of `_robot_world` without views that are far off, and the misfit (N,), rad, of all."""
    own = np.ones(len(axes), dtype=bool)
    world, misfit = np.eye(3), np.zeros(len(axes))
    for _ in range(_ROUNDS):
        world, mounted = _robot_world(axes[own], measured[own])
        left = np.matmul(np.swapaxes(measured, 1, 2), world @ axes @ mounted)
        misfit = np.linalg.norm(rotation_vector(left), axis=1)
        own = misfit <= max(_FOREIGN * float(np.median(misfit)), _LEAST_LIMIT)
    return world, misfit


def _robot_world(axes: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations Z (3, 3) of the base and T (3, 3) of the target with M = Z A T for axes A (N, 3, 3) of the hand and measured ones M."""
    moments = np.einsum("iab,icd->acdb", measured, axes).reshape(9, 9)
    left, _, right = np.linalg.svd(moments)
    world, mounted = left[:, 0].reshape(3, 3), right[0].reshape(3, 3)
    if np.linalg.det(world) < 0:
        world, mounted = -world, -mounted
    world = _nearest_rotation(world)
    for _ in range(_PASSES):
        mounted = _nearest_rotation(np.einsum("icd,ac,iab->db", axes, world, measured))
        world = _nearest_rotation(np.einsum("iab,db,icd->ac", measured, mounted, axes))
    return world, mounted


def _nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    left, _, right = np.linalg.svd(matrix)
    return left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def _turns_enough(model: RobotModel, station: str, target: str, axes: np.ndarray) -> bool:
    """Whether the hand turns about two axes at least; False for a robot that cannot. Raises `FlexcalError` where it only does not."""
    angles, directions = _rotations(axes)
    if angles[1] >= _LEAST_TURN:
        return True
    lower, upper = joint_ranges(model)
    postures = np.random.default_rng(0).uniform(lower, upper, (_POSTURES, model.n))
    able = _rotations(point_kinematics(model, postures, point=target, jacobians=False).orientation)[0]
    if able[1] < _ABLE:
        return False
    found = f"at its {len(axes)} views '{station}'"
    if angles[0] < _LEAST_TURN:
        raise FlexcalError(
            "E-CAL-025",
            f"{found} sees the hand turn by {np.rad2deg(angles[0]):.1f}° only (rms), which does not tell where camera or board is on it; "
            "turn the hand about two different axes by 20° or more between the views, not only move it.",
        )
    axis = directions[0] * np.sign(directions[0][np.argmax(np.abs(directions[0]))])
    named = ", ".join(f"{value:.2f}" for value in axis.round(2) + 0.0)
    raise FlexcalError(
        "E-CAL-026",
        f"{found} sees the hand turn about one direction only, [{named}] in the base frame (by {np.rad2deg(angles[0]):.0f}° rms, about "
        f"others by {np.rad2deg(angles[1]):.1f}°), which does not tell where camera or board is on it along that; turn the hand about an "
        "axis across it too, by 20° or more.",
    )


def _rotations(axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root mean square rotations (3,), rad, of orientations (N, 3, 3) about their mean, the largest first, and about which axes (3, 3)."""
    mean = _nearest_rotation(axes.sum(axis=0))
    vectors = rotation_vector(np.matmul(axes, mean.T))
    sizes, directions = np.linalg.eigh(vectors.T @ vectors / len(vectors))
    return np.sqrt(np.maximum(sizes[::-1], 0.0)), directions[:, ::-1].T
