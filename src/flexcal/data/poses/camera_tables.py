"""Files of joint positions at which a camera saw a board: CSV or Parquet, with images or with corners that were found in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data import camera as camera_views  # loaded where a table has images
from flexcal.data.poses.checks import check_same_pose
from flexcal.data.poses.columns import (
    approach_columns,
    first_point,
    payload_column,
    target_column,
    whole_numbers,
)
from flexcal.data.poses.pose_set import PoseSet
from flexcal.data.tables import Table, TableFile, assign, check_joint_units
from flexcal.files.structuring import suggestion
from flexcal.model.kinematics import point_kinematics

if TYPE_CHECKING:
    from flexcal.data.camera import FreeViews, View
    from flexcal.model.robot import CameraConfig, RobotModel

CAMERA_COLUMNS = ("camera", "image")
_WRONG, _WORSE = 5.0, 2.5
"""Ratios of a view's residual to the median of all views from which it is not used, and from which a blurred one is not."""
_BLURRED = 1.7
"""Ratio of the width of an image's edges to the median of those that show the board from which it is blurred."""
_CORNERS = ("corner", "u", "v")
_NAMED = 8
"""Number of views that a sentence names."""


def measures_images(file: TableFile) -> bool:
    """Whether a file has images, or corners found in images."""
    return "image" in file.columns or set(_CORNERS) <= set(file.columns)


def read_views(file: TableFile, model: RobotModel, further: Sequence[str] = ()) -> PoseSet:
    """Read rows of `pose`, q1…qn and `image`, the path of an image beside the file, or of `pose`, q1…qn, `corner`, `u` and `v`, pixels.

    Optional are `camera`, a name under `measurements:` of robot.yaml, `station`, the place of the board or of the camera in the cell,
    `target`, `payload`, `approach1`…, and the `further` columns, which are not used. Raises `InputError` where robot.yaml declares no
    camera, for an unknown one, for a corner that the board does not have, for an image that cannot be read or shows no board, for corners
    of which no camera makes sense, for a mirrored board, and where several points may be what is seen. Views without the board and
    blurred ones are left out, and noted.
    """
    images = "image" in file.columns
    texts = (*CAMERA_COLUMNS, "station", "target", *further)
    texts = tuple(dict.fromkeys(name for name in texts if name in file.columns))
    signals = assign(
        file, model, ("pose", "q"), ("payload", "approach"), (*texts, *(() if images else _CORNERS))
    )
    table = file.read(texts)
    values = {name: signal.values(table) for name, signal in signals.items()}
    check_joint_units(model, table, signals["q"], values["q"])
    pose = whole_numbers(table, signals["pose"].columns[0], values["pose"][:, 0])
    check_same_pose(pose, values["q"], table)
    name, camera = _camera(table, model)
    first = np.unique(pose, return_index=True)[1]
    first = first[np.argsort(first)]
    if images:
        paths = [file.path.parent / text for text in table.columns["image"][first].tolist()]
        views, size = camera_views.detected_views(camera, paths)
    else:
        views, size = _tabled_views(table, camera, pose, first), np.array(camera.size, dtype=float)
    shown = np.array([len(view.points) >= camera_views.FEWEST_CORNERS for view in views])
    sharp = np.median([view.edge for view, enough in zip(views, shown, strict=True) if enough] or [np.nan])
    # without contrast an image is empty, not blurred
    blurred = np.array([np.isfinite(view.edge) and view.edge > _BLURRED * sharp for view in views])
    blank = [
        (view.name, bool(soft))
        for view, enough, soft in zip(views, shown, blurred, strict=True)
        if not enough
    ]
    blurred = blurred[shown]
    views, first = [view for view, enough in zip(views, shown, strict=True) if enough], first[shown]
    found = camera_views.free_views(views, size)
    usable = _usable(file, views, found, blurred)
    notes = _left_out(name, views, found, usable, blurred, blank)
    rows = first[usable]
    _check_side(file, found)
    target = _targets(table, model, name)
    if camera.board.kind == "chessboard":
        found, turned = _upright(model, found, values["q"][first], str(target[0]))
        notes += (
            [f"{turned} views had the chessboard upside down, which looks the same; they are turned"]
            if turned
            else []
        )
    poses = camera_views.view_poses(found, on_hand=camera.mounted == "hand")
    payload, approach = payload_column(table, signals, model), approach_columns(table, signals)
    covariance = poses.covariance[usable]
    spread = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return PoseSet(
        q=values["q"][rows],
        position=poses.position[usable],
        sigma=spread[:, :3],
        torque=None,
        payload=None if payload is None else payload[rows],
        target=target[rows],
        station=table.columns["station"][rows] if "station" in texts else np.full(len(rows), name),
        temperature=None,
        pose=pose[rows],
        quaternion_wxyz=poses.quaternion_wxyz[usable],
        orientation_sigma=np.sqrt(np.mean(spread[:, 3:] ** 2, axis=1)),
        covariance=covariance,
        camera=np.full(len(rows), name),
        by_lens=poses.by_lens[usable],
        approach=None if approach is None else approach[rows],
        lenses={name: camera_views.Lens(found.lens, found.covariance)},
        notes=tuple(notes),
    )


def _camera(table: Table, model: RobotModel) -> tuple[str, CameraConfig]:
    cameras = {name: item for name, item in model.config.measurements.items() if item.kind == "camera"}
    if not cameras:
        raise table.file.error(
            "E-POSES-045",
            "there are images of a board, but robot.yaml declares no camera; add `measurements: {camera: {kind: camera, size: [1280, 960], "
            "board: {kind: charuco, columns: 9, rows: 7, square: 0.03, marker: 0.022}}}` with the sizes in m.",
        )
    if "camera" not in table.columns:
        return next(iter(cameras.items()))
    named = dict.fromkeys(table.columns["camera"].tolist())
    for name in named:
        if name not in cameras:
            hint = suggestion(name, list(cameras)) or f"; known are {', '.join(cameras)}."
            row = int(np.argmax(table.columns["camera"] == name))
            raise table.error(
                "E-POSES-046", row, "camera", f"there is no camera '{name}' in robot.yaml{hint}"
            )
    if len(named) > 1:
        raise table.file.error("E-POSES-047", "there are several cameras; give a file for each.")
    name = next(iter(named))
    return name, cameras[name]


def _tabled_views(table: Table, camera: CameraConfig, pose: np.ndarray, first: np.ndarray) -> list[View]:
    board = camera_views.board_corners(camera.board)
    numbers = [np.asarray(table.columns[name], dtype=float) for name in _CORNERS]
    corner = whole_numbers(table, "corner", numbers[0])
    known = (corner >= 0) & (corner < len(board))
    if not known.all():
        row = int(np.argmin(known))
        raise table.error(
            "E-POSES-048", row, "corner", f"the board has corners 0 to {len(board) - 1}, not {corner[row]}."
        )
    pixels = np.column_stack(numbers[1:])
    outside = (pixels < -1).any(axis=1) | (pixels > np.array(camera.size) + 1).any(axis=1)
    if outside.any():
        row = int(np.argmax(outside))
        width, height = camera.size
        raise table.error(
            "E-POSES-049",
            row,
            "u",
            f"the corner lies at {pixels[row, 0]:g}, {pixels[row, 1]:g}, outside the image of {width} × {height} pixels.",
        )
    views = []
    for row in first:
        own = pose == pose[row]
        views.append(camera_views.View(f"pose {pose[row]}", board[corner[own]], pixels[own]))
    return views


def _usable(file: TableFile, views: Sequence[View], found: FreeViews, blurred: np.ndarray) -> np.ndarray:
    """Numbers of the views whose corners are where they should be, `blurred` (V,) ones judged sooner; raises `InputError` where most
    corners fit no camera.
    """
    wrong, corners = int(found.wrong.sum()), sum(len(view.points) for view in views)
    if wrong > corners // 4:
        raise file.error(
            "E-POSES-050",
            f"{wrong} of {corners} corners fit no camera; check columns, rows and corner numbers of the board.",
        )
    most = np.where(blurred, _WORSE, _WRONG) * np.median(found.residuals)
    return np.flatnonzero(found.residuals <= most)


def _left_out(
    name: str,
    views: Sequence[View],
    found: FreeViews,
    usable: np.ndarray,
    blurred: np.ndarray,
    blank: Sequence[tuple[str, bool]],
) -> list[str]:
    """Sentences on the views of a camera that are not used."""
    out = [k for k in range(len(views)) if k not in set(usable.tolist())]
    named = {
        soft: [f"{views[k].name} ({found.residuals[k]:.1f} px)" for k in out if blurred[k] == soft]
        for soft in (True, False)
    }
    soft = [*(view for view, unsharp in blank if unsharp), *named[True]]
    empty = [view for view, unsharp in blank if not unsharp]
    usual = float(np.median(found.residuals))
    notes = []
    if soft:
        notes.append(
            f"{name}: blurred and left out, their edges being far wider than those of the others: {_some(soft)}"
        )
    if named[False]:
        cause = (
            "wrongly detected"
            if np.isfinite([view.edge for view in views]).all()
            else "blurred or wrongly detected"
        )
        notes.append(
            f"{name}: {len(named[False])} views are left out as {cause}, with corners that scatter by far more than the usual "
            f"{usual:.2g} px: {_some(named[False])}"
        )
    if empty:
        notes.append(
            f"{name}: {len(empty)} views show fewer than {camera_views.FEWEST_CORNERS} corners of the board: {_some(empty)}"
        )
    return notes


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} others" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def _upright(model: RobotModel, found: FreeViews, q: np.ndarray, target: str) -> tuple[FreeViews, int]:
    """Views with their chessboards the same way up, and how many were turned for it."""
    hand = point_kinematics(model, q, point=target, jacobians=False).orientation
    turned = camera_views.half_turns(hand, found.rotation)
    signs = np.where(turned[:, None], [-1.0, -1.0, 1.0], 1.0)
    return replace(found, rotation=found.rotation * signs[:, None, :]), int(turned.sum())


def _targets(table: Table, model: RobotModel, camera: str) -> np.ndarray:
    """Names (N,) of the points: those of a column, else the only point, or that with the name of the camera; raises `InputError` for
    several others.
    """
    if "target" in table.columns:
        return target_column(table, model)
    point = first_point(table.file, model)
    if len(model.points) > 1:
        if camera not in model.points:
            named = ", ".join(model.points)
            raise table.file.error(
                "E-POSES-066",
                f"robot.yaml has several points ({named}), none named as the camera {camera}; name it so, or add a column 'target'.",
            )
        point = camera
    return np.full(len(table), point)


def _check_side(file: TableFile, found: FreeViews) -> None:
    """Raise `InputError` where the board is seen from behind, as with corners that are numbered mirrored."""
    towards = np.einsum("vi,vi->v", found.rotation[:, :, 2], found.translation)
    if np.median(np.sign(towards)) < 0:
        raise file.error(
            "E-POSES-051",
            "the board is mirrored: its corners run clockwise where robot.yaml says anticlockwise; reverse the columns of the corner "
            "numbers, or check the images.",
        )
