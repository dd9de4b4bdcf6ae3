"""Errors over the working volume as coloured points, with a cutting plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from flexcal.studio.scene.colour_scale import ColourScale

if TYPE_CHECKING:
    import viser

Axis = Literal["x", "y", "z"]


class AccuracyVolume:
    """Points of the working volume, coloured by an error; those on one side of a plane can be hidden.

    Parameters
    ----------
    scene : viser.SceneApi
        Where they are drawn.
    points : ndarray
        Points (N, 3), m.
    values : ndarray
        Errors (N,), mm; points whose error is not finite are left out.
    scale : ColourScale, optional
        Colours of errors, mm; one for several sets of values makes their colours comparable. By default that of `values`.
    name : str
        Name of its nodes.
    size : float, optional
        Width of a point, m; by default that of the space that each point has.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        points: np.ndarray,
        values: np.ndarray,
        *,
        scale: ColourScale | None = None,
        name: str = "/accuracy",
        size: float | None = None,
    ) -> None:
        self.points, self.values = np.asarray(points, dtype=float), np.asarray(values, dtype=float)
        self.scale = scale or ColourScale.shared(self.values)
        self._scene, self._name = scene, name
        extent = np.ptp(self.points, axis=0) if len(self.points) else np.ones(3)
        space = np.cbrt(np.prod(np.maximum(extent, 1e-3)) / max(len(self.points), 1))
        self._size = float(0.6 * space) if size is None else size
        self._plane: tuple[int, float, bool] | None = None
        self._only: np.ndarray | None = None
        self._cloud: viser.PointCloudHandle
        self._draw()

    @property
    def mask(self) -> np.ndarray:
        """Which points (N,) are drawn."""
        finite = np.isfinite(self.values) & np.isfinite(self.points).all(axis=1)
        if self._only is not None:
            finite &= self._only
        if self._plane is None:
            return finite
        axis, position, flipped = self._plane
        behind = self.points[:, axis] >= position if flipped else self.points[:, axis] <= position
        return finite & behind

    def show(self, values: np.ndarray, scale: ColourScale | None = None) -> None:
        """Colour the points by other errors (N,), mm, such as those after calibration, on the same scale unless given another."""
        self.values = np.asarray(values, dtype=float)
        self.scale = scale or self.scale
        self._draw()

    def cut(self, axis: Axis, position: float, *, flipped: bool = False) -> None:
        """Hide points beyond `position`, m, along an axis of the base frame; with `flipped` those before it."""
        self._plane = "xyz".index(axis), float(position), flipped
        self._draw()

    def uncut(self) -> None:
        """Show all points."""
        self._plane = None
        self._draw()

    def restrict(self, rows: np.ndarray | None) -> None:
        """Hide the points outside a mask (N,); show them again with None."""
        self._only = rows
        self._draw()

    def remove(self) -> None:
        """Take it out of the scene."""
        self._cloud.remove()

    def _draw(self) -> None:
        shown = self.mask
        self._cloud = self._scene.add_point_cloud(
            self._name, self.points[shown], self.scale.colours(self.values[shown]), point_size=self._size,
            point_shape="circle", precision="float32",
        )  # fmt: skip
