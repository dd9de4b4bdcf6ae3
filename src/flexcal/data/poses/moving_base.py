"""Points measured on a robot whose base moves and is measured too, as a mobile manipulator's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import unit_quaternions
from flexcal.data.poses.pose_set import PoseSet
from flexcal.data.tables import Signal, Table
from flexcal.model.parts import rotation_wxyz, wxyz_rotation

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

BASE = ("base_xyz", "base_quaternion")
"""Quantities of the measured pose of the base."""
_TILTED = np.deg2rad(2)
"""Tilt of the base between poses, rad, above which gravity pulls the links in noticeably other directions."""


def seen_from_base(
    poses: PoseSet,
    table: Table,
    signals: Mapping[str, Signal],
    values: Mapping[str, np.ndarray],
    model: RobotModel,
) -> PoseSet:
    """What was measured as seen from the markers on the base, where its pose in the instrument's frame was measured beside.

    These markers then take the place of the instrument: where they are on the base link is estimated as a station. Raises `InputError`
    where only place or orientation of the base is given, and for a base that tilts under a robot with masses.
    """
    given = [name for name in BASE if name in values]
    if not given:
        return poses
    if len(given) < len(BASE):
        missing = next(name for name in BASE if name not in values)
        wanted = "base_x, base_y, base_z" if missing == "base_xyz" else "base_qw, base_qx, base_qy, base_qz"
        raise table.file.error(
            "E-POSES-064",
            f"there are {', '.join(signals[given[0]].columns)} but no {wanted}; give the whole measured pose of the base.",
        )
    turn = wxyz_rotation(unit_quaternions(table, signals["base_quaternion"], values["base_quaternion"]))
    if model.links.mass.any():
        _require_level(turn, table, signals["base_quaternion"])
    back = np.swapaxes(turn, 1, 2)
    moved = np.matmul(back, (poses.position - values["base_xyz"])[:, :, None])[:, :, 0]
    sigma = np.sqrt(np.matmul(back**2, poses.sigma[:, :, None] ** 2)[:, :, 0])
    poses = replace(poses, position=moved, sigma=sigma)
    if poses.quaternion_wxyz is None:
        return poses
    return replace(
        poses, quaternion_wxyz=rotation_wxyz(np.matmul(back, wxyz_rotation(poses.quaternion_wxyz)))
    )


def _require_level(turn: np.ndarray, table: Table, signal: Signal) -> None:
    """Raise `InputError` at the row whose base is tilted most against the axis about which the rotations (N, 3, 3) turn."""
    left, _, right = np.linalg.svd(turn.mean(axis=0))
    tilt = np.arccos(np.clip(np.abs(turn @ right[0] @ left[:, 0]), 0.0, 1.0))
    row = int(np.argmax(tilt))
    if tilt[row] > _TILTED:
        raise table.error(
            "E-POSES-065",
            row,
            signal.columns[0],
            f"the base is tilted by {np.rad2deg(tilt[row]):.1f}° against other rows, so that gravity pulls the arm in another direction of "
            "the base; only a base that stays level can move: measure it so, or add its tilting axes to the URDF as joints.",
        )
