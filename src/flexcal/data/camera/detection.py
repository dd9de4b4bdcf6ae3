"""Corners of a board in images, found by OpenCV (extra `camera`)."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexcal.data.camera.board import board_corners
from flexcal.data.camera.bundle import FEWEST_CORNERS, View
from flexcal.data.camera.sharpness import edge_width
from flexcal.errors import FlexcalError, InputError
from flexcal.files.transaction import read_bytes
from flexcal.printable import printable_errors

if TYPE_CHECKING:
    from flexcal.model.robot import BoardConfig, CameraConfig

_MOST_PIXELS = 100_000_000
"""Largest number of pixels of an image, by its header."""
_BLURRED = 3.0
"""Width of edges, pixels, from which hardly any board is found."""


def detected_views(camera: CameraConfig, paths: Sequence[Path]) -> tuple[list[View], np.ndarray]:
    """Views of the board in images, one each, without corners where it is not found, and the size (2,) of these, pixels.

    Raises `FlexcalError` without OpenCV, and `InputError` for an image that is not there, is of another size, and where most of them do
    not show the board.
    """
    os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(_MOST_PIXELS))  # OpenCV reads it once, now
    try:
        import cv2
    except ImportError:
        raise FlexcalError(
            "E-POSES-052",
            "images need OpenCV: pip install 'flexcal[camera]'; or give the corners: columns corner, u, v.",
        ) from None
    find, board = _detector(cv2, camera.board), board_corners(camera.board)
    views = []
    for path in paths:
        image = _gray(cv2, path)
        if image is None:
            raise InputError("E-POSES-053", f"{path} is no image that can be read; check the column 'image'.")
        width, height = camera.size
        if image.shape != (height, width):
            raise InputError(
                "E-POSES-054",
                f"{path} has {image.shape[1]} × {image.shape[0]} pixels, but robot.yaml says {width} × {height}; correct `size:`.",
            )
        numbers, pixels = find(image)
        views.append(View(path.name, board[numbers], pixels, edge_width(cv2, image)))
    without = [path for path, view in zip(paths, views, strict=True) if len(view.points) < FEWEST_CORNERS]
    if 2 * len(without) > len(paths):
        named = f", as {without[0].name}" if len(without) > 1 else f", {without[0].name}"
        widths = [view.edge for view in views if len(view.points) < FEWEST_CORNERS and np.isfinite(view.edge)]
        blurred = widths and float(np.median(widths)) > _BLURRED
        advice = (
            f"their edges are {np.median(widths):.0f} pixels wide: take sharper images, standing still and in focus."
            if blurred
            else "correct `board:` (its kind, columns, rows and dictionary), or take unmirrored images."
        )
        raise InputError(
            "E-POSES-055",
            f"{without[0].parent}: {len(without)} of {len(paths)} images{named}, show fewer than {FEWEST_CORNERS} corners of the board "
            f"that robot.yaml declares; {advice}",
        )
    return views, np.array(camera.size, dtype=float)


def _gray(cv2: Any, path: Path) -> np.ndarray | None:
    """Image (height, width); None where there is none, or nothing that OpenCV reads as one."""
    try:
        content = np.frombuffer(read_bytes(path), dtype=np.uint8)
        with printable_errors("OpenCV"):
            return cv2.imdecode(content, cv2.IMREAD_GRAYSCALE)
    except (OSError, cv2.error):
        return None


def _detector(cv2: Any, board: BoardConfig) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    if board.kind == "chessboard":
        return lambda image: _chessboard(cv2, board, image)
    known = getattr(cv2.aruco, board.dictionary, None)
    if known is None:
        raise FlexcalError(
            "E-POSES-056", f"OpenCV has no dictionary '{board.dictionary}'; it is called as DICT_4X4_50."
        )
    dictionary = cv2.aruco.getPredefinedDictionary(known)
    if board.kind == "tags":
        precisely = cv2.aruco.DetectorParameters()
        precisely.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
        markers = cv2.aruco.ArucoDetector(dictionary, precisely)
        return lambda image: _tags(markers, board, image)
    printed = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, dictionary)
    charuco = cv2.aruco.CharucoDetector(printed)

    def find(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        corners, numbers, _, _ = charuco.detectBoard(image)
        return _none() if numbers is None else (numbers.ravel(), corners.reshape(-1, 2).astype(float))

    return find


def _chessboard(cv2: Any, board: BoardConfig, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found, corners = cv2.findChessboardCornersSB(image, (board.columns - 1, board.rows - 1))
    return (np.arange(len(corners)), corners.reshape(-1, 2).astype(float)) if found else _none()


def _tags(markers: Any, board: BoardConfig, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    corners, numbers, _ = markers.detectMarkers(image)
    if numbers is None:
        return _none()
    seen = [
        (k, own) for k, own in zip(numbers.ravel(), corners, strict=True) if k < board.columns * board.rows
    ]
    if not seen:
        return _none()
    return (
        np.concatenate([4 * k + np.arange(4) for k, _ in seen]),
        np.concatenate([own.reshape(4, 2) for _, own in seen]).astype(float),
    )


def _none() -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(0, dtype=int), np.zeros((0, 2))
