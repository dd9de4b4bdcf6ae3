"""The measuring instrument and its lines of sight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.model.kinematics import box
from flexcal.studio.scene.colours import BLOCKED, INSTRUMENT, LINE_OF_SIGHT

if TYPE_CHECKING:
    import viser

_HALF = np.array([0.05, 0.05, 0.09])


class Instrument:
    """A laser tracker or camera at `position` (3,), m, labelled `label`, which is drawn as plain text."""

    def __init__(
        self, scene: viser.SceneApi, position: np.ndarray, label: str = "", *, name: str = "/instrument"
    ) -> None:
        self._scene, self._name = scene, name
        self._root = scene.add_frame(name, show_axes=False)
        self._stand = scene.add_frame(f"{name}/stand", show_axes=False)
        vertices, faces = box(_HALF)
        scene.add_mesh_simple(
            f"{name}/stand/body", vertices, faces, color=INSTRUMENT, flat_shading=True,
            cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        if label:
            scene.add_label(f"{name}/stand/label", label, position=(0, 0, 0.12), anchor="bottom-center")
        self._points, self._blocked = np.zeros((0, 3)), np.zeros(0, dtype=bool)
        self.position = position

    @property
    def position(self) -> np.ndarray:
        """Where it stands (3,), m."""
        return np.array(self._stand.position)

    @position.setter
    def position(self, position: np.ndarray) -> None:
        self._stand.position = np.asarray(position, dtype=float)
        self.look_at(self._points, self._blocked)

    def look_at(self, points: np.ndarray, blocked: np.ndarray | None = None) -> None:
        """Draw lines of sight to `points` (N, 3), m, those with `blocked` (N,) in another colour; none for no points."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        kept = np.isfinite(points).all(axis=1)
        blocked = np.zeros(len(points), dtype=bool) if blocked is None else np.asarray(blocked, dtype=bool)
        self._points, self._blocked = points[kept], blocked[kept]
        lines = np.stack([np.broadcast_to(self.position, self._points.shape), self._points], axis=1)
        colours = np.where(self._blocked[:, None], BLOCKED, LINE_OF_SIGHT).astype(np.uint8)
        self._scene.add_line_segments(
            f"{self._name}/lines", lines, np.repeat(colours[:, None], 2, axis=1),
            thickness=1.5, thickness_units="screen", visible=bool(len(lines)),
        )  # fmt: skip

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()
