"""Corners of printed boards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flexcal.model.robot import BoardConfig


def board_corners(board: BoardConfig) -> np.ndarray:
    """Corners (K, 3), m, of a board by number, from its middle: x to the right and y down as it is read, z into it.

    The inner corners of a chessboard or ChArUco board row by row, from its upper left corner as OpenCV counts them; of a grid of tags the
    four corners of each tag, clockwise from its upper left, tag by tag.
    """
    if board.kind == "tags":
        pitch, marker = board.square, board.marker
        first = (
            np.stack(np.meshgrid(np.arange(board.columns), np.arange(board.rows)), -1).reshape(-1, 1, 2)
            * pitch
        )
        around = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * marker
        flat = (first + around).reshape(-1, 2)
    else:
        grid = np.meshgrid(np.arange(1, board.columns), np.arange(1, board.rows))
        flat = np.stack(grid, -1).reshape(-1, 2) * board.square
    flat = flat - (flat.min(axis=0) + flat.max(axis=0)) / 2
    return np.column_stack([flat, np.zeros(len(flat))])
