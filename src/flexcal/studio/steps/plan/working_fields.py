"""The working volume: numbers of its corners, and the box in the scene that follows them and is dragged."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import InputError
from flexcal.studio.scene import WorkingBox

if TYPE_CHECKING:
    from flexcal.studio.window import Window

_STEP = 0.01
_KEPT = "plan.box"


class WorkingFields:
    """A box in the robot's base frame: its corners in fields, m, at the current place of the window's GUI, and in the scene.

    Parameters
    ----------
    window : Window
        Where it is shown.
    start : ndarray
        Corners (2, 3), m, where none were chosen before.
    changed : callable
        Called in the window's thread after each change.
    """

    def __init__(self, window: Window, start: np.ndarray, changed: Callable[[], None]):
        self._window, self._changed = window, changed
        corners = (
            _corners(window.choices.get(_KEPT, [])) if window.choices.get(_KEPT, []) else np.round(start, 3)
        )
        hint = "x, y, z in the robot's base frame; or drag the corner in the scene."
        self._fields = [
            window.gui.add_vector3(label, corner, step=_STEP, hint=hint)
            for label, corner in zip(("Smallest x y z / m", "Largest x y z / m"), corners, strict=True)
        ]
        for field in self._fields:
            field.on_update(lambda event: event.client and window.post(self._typed))
        self._box: WorkingBox | None = None

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
                    "E-STUDIO-032",
                    f"the working volume reaches from {one:g} to {other:g} m along {axis}; give the smallest value first.",
                )
        return ",".join(f"{one:.10g}:{other:.10g}" for one, other in zip(low, high, strict=True))

    def show(self, visible: bool) -> None:
        """Show or hide fields and box."""
        for field in self._fields:
            field.visible = visible
        if visible and self._box is None:
            low, high = self.corners
            self._box = WorkingBox(self._window.scene, low, high, self._drag)
        elif not visible:
            self.close()

    def close(self) -> None:
        """Remove the box from the scene."""
        if self._box is not None:
            self._box.remove()
            self._box = None

    def _drag(self, lower: np.ndarray, upper: np.ndarray) -> None:
        self._window.post(lambda: self._dragged(lower, upper))

    def _dragged(self, lower: np.ndarray, upper: np.ndarray) -> None:
        for field, corner in zip(self._fields, (lower, upper), strict=True):
            field.value = np.round(corner, 3)
        self._take()

    def _typed(self) -> None:
        if self._box is not None:
            low, high = self.corners
            self._box.corners = low, high
        self._take()

    def _take(self) -> None:
        self._window.choices.put(_KEPT, self.corners.tolist())
        self._changed()


def _corners(kept: list) -> np.ndarray:
    """Corners (2, 3) as they were kept; zeros where the file of choices has something else."""
    try:
        corners = np.array(kept, dtype=float)
    except (TypeError, ValueError):
        return np.zeros((2, 3))
    return corners if corners.shape == (2, 3) and np.isfinite(corners).all() else np.zeros((2, 3))
