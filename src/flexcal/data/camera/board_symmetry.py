"""Views in which a chessboard, which looks the same upside down, was found turned by 180°, told by how the robot turned."""

from __future__ import annotations

import numpy as np


def half_turns(hand: np.ndarray, board: np.ndarray) -> np.ndarray:
    """Views (V,) whose board is to be turned by 180° about its normal, the fewer ones.

    `hand` (V, 3, 3) are orientations of the hand in the base frame, `board` (V, 3, 3) of the board before the camera. Between two views
    both turn by the same angle, whatever the mountings; the signs that fit all pairs best are those of the leading eigenvector of the
    matrix of how much better the angle of each pair fits without a half turn.
    """
    pairs = np.einsum("vab,wab->vw", hand, hand)
    same = np.einsum("vab,wab->vw", board, board)
    turned = np.einsum("vab,wab->vw", board, board * np.array([-1.0, -1.0, 1.0]))
    angle, plain, half = (np.arccos(np.clip((trace - 1) / 2, -1.0, 1.0)) for trace in (pairs, same, turned))
    better = np.abs(half - angle) - np.abs(plain - angle)
    leading = np.linalg.eigh(better)[1][:, -1]
    away = leading < 0
    return ~away if 2 * away.sum() > len(away) else away
