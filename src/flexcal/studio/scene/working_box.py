"""The working volume: a box whose corners are dragged."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.scene.colours import SELECTED

if TYPE_CHECKING:
    import viser

_EDGES = np.array([(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit])


class WorkingBox:
    """A box along the axes of the base frame, drawn by its edges, with handles at two opposite corners.

    Parameters
    ----------
    scene : viser.SceneApi
        Where it is drawn.
    lower, upper : ndarray
        Corners (3,), m.
    changed : callable
        Called with the lower and the upper corner (3,), m, while a handle is dragged.
    name : str
        Name of its nodes.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        lower: np.ndarray,
        upper: np.ndarray,
        changed: Callable[[np.ndarray, np.ndarray], None],
        *,
        name: str = "/working_volume",
    ) -> None:
        self._changed = changed
        self._root = scene.add_frame(name, show_axes=False)
        self._edges = scene.add_line_segments(
            f"{name}/edges", np.zeros((12, 2, 3)), SELECTED, thickness=2.0, thickness_units="screen"
        )
        self._handles = [
            scene.add_transform_controls(
                f"{name}/corner_{k}", scale=0.22, disable_rotations=True, disable_sliders=True, line_width=4.0
            )
            for k in range(2)
        ]
        self.corners = lower, upper
        for handle in self._handles:
            handle.on_update(lambda _: self._dragged())

    @property
    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,), m; setting them calls nobody."""
        ends = np.array([handle.position for handle in self._handles])
        return ends.min(axis=0), ends.max(axis=0)

    @corners.setter
    def corners(self, corners: tuple[np.ndarray, np.ndarray]) -> None:
        for handle, corner in zip(self._handles, corners, strict=True):
            handle.position = np.asarray(corner, dtype=float)
        self._draw()

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()

    def _dragged(self) -> None:
        self._draw()
        self._changed(*self.corners)

    def _draw(self) -> None:
        self._edges.points = box_edges(*self.corners).astype(np.float32)


def box_edges(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Ends (12, 2, 3) of the edges of a box with these corners (3,)."""
    is_upper = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return np.where(is_upper == 1, upper, lower)[_EDGES]
