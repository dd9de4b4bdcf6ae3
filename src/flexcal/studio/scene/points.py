"""Points in the scene: measured ones, and targets."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.scene.colours import MEASURED, SELECTED
from flexcal.studio.scene.merged_bodies import MergedBodies

if TYPE_CHECKING:
    import viser

_CORNERS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
_FACES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
_LARGER = 1.8
"""Size of the selected point relative to that of the others."""


class Points:
    """Points, each a small octahedron, all of one colour or of one a point.

    Parameters
    ----------
    scene : viser.SceneApi
        Where they are drawn.
    positions : ndarray
        Positions (N, 3), m; rows that are not finite are left out.
    colours : ndarray, optional
        Colours (3,) or (N, 3), 0 to 255; few different ones are drawn fastest.
    name : str
        Name of their nodes.
    size : float
        Width of a point, m.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        positions: np.ndarray,
        colours: np.ndarray | tuple[int, int, int] = MEASURED,
        *,
        name: str = "/points",
        size: float = 0.018,
    ) -> None:
        self._size = size
        self._points = MergedBodies(scene, name, _FACES)
        self._mark = MergedBodies(scene, f"{name}/selected", _FACES)
        self._selected: int | None = None
        self.positions = np.zeros((0, 3))
        self.show(positions, colours)

    def show(self, positions: np.ndarray, colours: np.ndarray | tuple[int, int, int] = MEASURED) -> None:
        """Draw other points, as the constructor does; the selected number stays selected where there is one."""
        self.positions = np.asarray(positions, dtype=float).reshape(-1, 3)
        of_each = np.broadcast_to(np.asarray(colours, dtype=int), self.positions.shape)
        different, numbers = np.unique(of_each, axis=0, return_inverse=True)
        self._points.show(self._corners(1.0), numbers.ravel(), different)
        self.highlight(self._selected)

    def highlight(self, number: int | None) -> None:
        """Mark one point as selected, or none."""
        self._selected = number
        rows = [] if number is None or number >= len(self.positions) else [number]
        self._mark.show(self._corners(_LARGER)[rows], np.zeros(len(rows), dtype=int), np.array([SELECTED]))

    def on_click(self, callback: Callable[[int], None]) -> None:
        """Call `callback` with the number of the point that was clicked."""
        self._points.on_click(callback)

    def remove(self) -> None:
        """Take them out of the scene."""
        self._points.remove()

    def _corners(self, factor: float) -> np.ndarray:
        return self.positions[:, None] + factor * self._size / 2 * _CORNERS
