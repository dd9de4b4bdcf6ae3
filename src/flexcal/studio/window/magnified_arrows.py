"""Errors as arrows in the scene, with a slider for their length."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.scene import ResidualArrows

if TYPE_CHECKING:
    from collections.abc import Callable

    from flexcal.studio.window.window import Window

_LENGTH = 0.1
"""Length, m, of the larger arrows at first."""


class MagnifiedArrows:
    """Arrows that a slider at the current place of the window's GUI makes longer than the errors are.

    Parameters
    ----------
    window : Window
        Where they are shown.
    sizes : ndarray
        Sizes (N,) of errors, m, by which the slider begins: the larger arrows are then 0.1 m long.
    most : int
        Largest magnification.
    """

    def __init__(self, window: Window, sizes: np.ndarray, most: int):
        self._window = window
        size = max(float(np.percentile(sizes, 90)), 1e-9)
        start = int(np.clip(_LENGTH / size, 1, most))
        self._factor = window.gui.add_slider("Magnify", min=1, max=most, step=1, initial_value=start)
        self._factor.on_update(lambda _: window.post(self._stretch))
        self._arrows: ResidualArrows | None = None

    def show(
        self, starts: np.ndarray, vectors: np.ndarray, picked: Callable[[int], None] | None = None
    ) -> None:
        """Show arrows (N, 3), m, in place of those before; `picked` is called in the window's thread with the number of one."""
        self.remove()
        self._arrows = ResidualArrows(self._window.scene, starts, vectors, self._factor.value)
        if picked is not None:
            self._arrows.on_click(lambda number: self._window.post(lambda: picked(number)))

    def highlight(self, number: int | None) -> None:
        """Mark one arrow as selected, or none."""
        if self._arrows is not None:
            self._arrows.highlight(number)

    def remove(self) -> None:
        """Take them out of the scene."""
        if self._arrows is not None:
            self._arrows.remove()
            self._arrows = None

    def _stretch(self) -> None:
        if self._arrows is not None:
            self._arrows.exaggeration = self._factor.value
