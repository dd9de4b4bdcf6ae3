"""Errors of measured points as exaggerated arrows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.scene.colour_scale import ColourScale
from flexcal.studio.scene.colours import SELECTED
from flexcal.studio.scene.merged_bodies import MergedBodies
from flexcal.studio.scene.rotations import across

if TYPE_CHECKING:
    import viser

_SIDES = 4
_COLOURS = 8
_LARGER = 2.0
"""Width of the selected arrow relative to that of the others."""


class ResidualArrows:
    """Arrows, narrow pyramids whose tip is the end, in colours of their true lengths.

    Parameters
    ----------
    scene : viser.SceneApi
        Where they are drawn.
    starts : ndarray
        Points (N, 3), m, from which they go.
    vectors : ndarray
        Errors (N, 3), m; rows that are not finite are left out.
    exaggeration : float
        How many times longer than they are they are drawn.
    scale : ColourScale, optional
        Colours of their lengths, m; by default up to the longest but a few.
    name : str
        Name of their nodes.
    width : float
        Width of an arrow, m.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        starts: np.ndarray,
        vectors: np.ndarray,
        exaggeration: float = 1.0,
        *,
        scale: ColourScale | None = None,
        name: str = "/residuals",
        width: float = 0.01,
    ) -> None:
        self.starts, self.vectors = np.asarray(starts, dtype=float), np.asarray(vectors, dtype=float)
        lengths = np.linalg.norm(self.vectors, axis=1)
        self.scale = scale or ColourScale.shared(lengths)
        self._exaggeration, self._width = float(exaggeration), width
        self._selected: int | None = None
        corner = np.arange(_SIDES)
        sides = np.stack([corner, (corner + 1) % _SIDES, np.full(_SIDES, _SIDES)], axis=1)
        self._arrows = MergedBodies(scene, name, sides)
        self._mark = MergedBodies(scene, f"{name}/selected", sides)
        steps = np.minimum((self.scale.share(lengths) * _COLOURS).astype(int), _COLOURS - 1)
        self._arrows.show(self._corners(self._width), steps, self.scale.steps(_COLOURS))

    @property
    def exaggeration(self) -> float:
        """How many times longer than they are the arrows are drawn."""
        return self._exaggeration

    @exaggeration.setter
    def exaggeration(self, factor: float) -> None:
        self._exaggeration = float(factor)
        self._arrows.move(self._corners(self._width))
        self.highlight(self._selected)

    @property
    def ends(self) -> np.ndarray:
        """Tips (N, 3), m, as drawn."""
        return self.starts + self._exaggeration * self.vectors

    def highlight(self, number: int | None) -> None:
        """Mark one arrow as selected, or none."""
        self._selected = number
        rows = [] if number is None else [number]
        corners = self._corners(_LARGER * self._width)[rows]
        self._mark.show(corners, np.zeros(len(rows), dtype=int), np.array([SELECTED]))

    def on_click(self, callback: Callable[[int], None]) -> None:
        """Call `callback` with the number of the arrow that was clicked."""
        self._arrows.on_click(callback)

    def remove(self) -> None:
        """Take them out of the scene."""
        self._arrows.remove()

    def _corners(self, width: float) -> np.ndarray:
        """Corners (N, 5, 3): a square about the start, and the tip."""
        x, y = across(self.vectors)
        angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
        ring = x[:, None] * np.cos(angle)[:, None] + y[:, None] * np.sin(angle)[:, None]
        return np.concatenate([self.starts[:, None] + width / 2 * ring, self.ends[:, None]], axis=1)
