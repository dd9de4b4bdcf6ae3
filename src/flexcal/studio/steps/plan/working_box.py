"""The working volume: a box whose corners are numbers and can be dragged in the scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import InputError

if TYPE_CHECKING:
    from flexcal.studio.window import Window

_STEP = 0.01
_NODE = "/plan/working"
_COLOUR = (58, 130, 224)
_EDGES = np.array(
    [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 6], [5, 7], [6, 7]]
)


class WorkingBox:
    """A box in the robot's base frame: two corners in fields, m, and in the scene.

    Parameters
    ----------
    window : Window
        Where the fields are added, at the current place.
    start : ndarray
        Corners (2, 3), m, where none were chosen before.
    changed : callable
        Called in the window's thread after each change.
    """

    def __init__(self, window: Window, start: np.ndarray, changed: Callable[[], None]):
        self._window, self._changed = window, changed
        kept = window.choices.get("plan.box", [])
        corners = np.round(start, 3)
        if np.shape(kept) == (2, 3):
            corners = np.array(kept, dtype=float)
        hint = "x, y, z in the robot's base frame; or drag the corner in the scene."
        gui = window.gui
        self._fields = [
            gui.add_vector3(label, tuple(corner), step=_STEP, hint=hint)
            for label, corner in zip(("Smallest x, y, z / m", "Largest x, y, z / m"), corners, strict=True)
        ]
        self._handles = []
        self._lines = None
        for field in self._fields:
            field.on_update(lambda _: window.post(self._typed))
        self._visible = False

    @property
    def corners(self) -> np.ndarray:
        """Corners (2, 3), m: smallest and largest coordinates."""
        return np.array([field.value for field in self._fields], dtype=float)

    @property
    def option(self) -> str:
        """The box as `--working` takes it; raises `InputError` for corners that are none."""
        low, high = self.corners
        for axis, one, other in zip("xyz", low, high, strict=True):
            if not one < other:
                raise InputError(
                    "E-STUDIO-082",
                    f"the working volume reaches from {one:g} to {other:g} m along {axis}; give the smallest value first.",
                )
        return ",".join(f"{a:.10g}:{b:.10g}" for a, b in zip(low, high, strict=True))

    def show(self, visible: bool) -> None:
        """Show or hide fields and box."""
        for field in self._fields:
            field.visible = visible
        self._visible = visible
        self._draw()

    def close(self) -> None:
        """Remove it from the scene."""
        for node in (*self._handles, *([] if self._lines is None else [self._lines])):
            node.remove()
        self._handles, self._lines = [], None

    def _typed(self) -> None:
        self._keep()
        for handle, corner in zip(self._handles, self.corners, strict=False):
            handle.position = corner
        self._draw()
        self._changed()

    def _dragged(self) -> None:
        for field, handle in zip(self._fields, self._handles, strict=True):
            x, y, z = (float(f"{value:.3f}") for value in handle.position)
            field.value = (x, y, z)
        self._keep()
        self._draw()
        self._changed()

    def _keep(self) -> None:
        self._window.choices.put("plan.box", self.corners.tolist())

    def _draw(self) -> None:
        if not self._visible:
            self.close()
            return
        scene, corners = self._window.scene, self.corners
        ends = corners[(np.arange(8)[:, None] >> np.arange(3)) & 1, np.arange(3)]
        self._lines = scene.add_line_segments(
            f"{_NODE}/edges", ends[_EDGES], _COLOUR, thickness=2.0, thickness_units="screen"
        )
        if self._handles:
            return
        for number, corner in enumerate(corners):
            handle = scene.add_transform_controls(
                f"{_NODE}/corner_{number}",
                scale=0.15,
                disable_rotations=True,
                disable_sliders=True,
                position=corner,
            )
            handle.on_update(lambda _: self._window.post(self._dragged))
            self._handles.append(handle)
