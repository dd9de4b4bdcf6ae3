"""Many small bodies of one shape, drawn as a few meshes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import viser

_NEARLY = 0.008
"""Angle, rad, by which a click may miss a body: some five pixels."""


class MergedBodies:
    """Bodies of one shape in a few colours: those of one colour are one mesh.

    A processor without graphics draws a thousand arrows so in less time than as viser's arrows, line segments or batched meshes.

    Parameters
    ----------
    scene : viser.SceneApi
        Where they are drawn.
    name : str
        Name of their nodes.
    faces : ndarray
        Triangles (F, 3) of one body.
    """

    def __init__(self, scene: viser.SceneApi, name: str, faces: np.ndarray) -> None:
        self._scene, self._name, self._faces = scene, name, faces
        self._root = scene.add_frame(name, show_axes=False)
        self._meshes: dict[int, viser.MeshHandle] = {}
        self._members: dict[int, np.ndarray] = {}
        self._vertices = np.zeros((0, 0, 3))
        self._clicked: Callable[[viser.SceneClickEvent], None] | None = None

    def show(self, vertices: np.ndarray, colour_numbers: np.ndarray, colours: np.ndarray) -> None:
        """Draw N bodies with `vertices` (N, V, 3), m, each in the row of `colours` (C, 3) that `colour_numbers` (N,) names.

        Bodies with corners that are not finite are left out.
        """
        finite = np.isfinite(vertices).all(axis=(1, 2))
        with self._scene._owner.atomic():
            for mesh in self._meshes.values():
                mesh.remove()
            self._meshes, self._members, self._vertices = {}, {}, vertices
            for number in np.unique(colour_numbers[finite]).tolist():
                members = np.flatnonzero(finite & (colour_numbers == number))
                count, corners = len(members), vertices.shape[1]
                faces = (self._faces + corners * np.arange(count)[:, None, None]).reshape(-1, 3)
                red, green, blue = (int(part) for part in colours[number])
                self._members[number] = members
                self._meshes[number] = self._scene.add_mesh_simple(
                    f"{self._name}/colour_{number}", vertices[members].reshape(-1, 3), faces, color=(red, green, blue),
                    flat_shading=True, cast_shadow=False, receive_shadow=False,
                )  # fmt: skip

    def move(self, vertices: np.ndarray) -> None:
        """Give the bodies other `vertices` (N, V, 3); their colours, and which are drawn, stay."""
        self._vertices = vertices
        with self._scene._owner.atomic():
            for number, mesh in self._meshes.items():
                mesh.vertices = vertices[self._members[number]].reshape(-1, 3).astype(np.float32)

    def on_click(self, callback: Callable[[int], None]) -> None:
        """Call `callback` with the number of a body that is clicked, in place of the callback before.

        The scene is asked for clicks, not each mesh: viser would outline all bodies of a mesh under the pointer.
        """
        self._forget()

        @self._scene.on_click()
        def clicked(event: viser.SceneClickEvent) -> None:
            body = self.pick(np.array(event.ray_origin), np.array(event.ray_direction))
            if body is not None:
                callback(body)

        self._clicked = clicked

    def pick(self, origin: np.ndarray, direction: np.ndarray) -> int | None:
        """Number of the first body that a ray from `origin` (3,) along `direction` (3,) meets, else nearly meets; None for neither."""
        if not self._members:
            return None
        drawn = np.concatenate(list(self._members.values()))
        vertices, ray = self._vertices[drawn], np.asarray(direction, dtype=float)
        ray /= np.linalg.norm(ray)
        a, b, c = np.moveaxis(vertices[:, self._faces], 2, 0)
        along = _distance(np.asarray(origin, dtype=float), ray, a, b, c).min(axis=1)
        if np.isfinite(along).any():
            return int(drawn[np.argmin(along)])
        samples = np.concatenate([vertices, vertices.mean(axis=1, keepdims=True)], axis=1) - origin
        depth = samples @ ray
        beside = np.linalg.norm(samples - depth[..., None] * ray, axis=-1)
        angle = np.where(depth > 0, beside / np.maximum(depth, 1e-9), np.inf).min(axis=1)
        nearest = int(np.argmin(angle))
        return int(drawn[nearest]) if angle[nearest] < _NEARLY else None

    def remove(self) -> None:
        """Take them out of the scene."""
        self._forget()
        self._root.remove()

    def _forget(self) -> None:
        if self._clicked is not None:
            self._scene.remove_click_callback(self._clicked)
        self._clicked = None


def _distance(origin: np.ndarray, ray: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Distance (N, F) along a ray to triangles with corners (N, F, 3), infinite where it misses (Möller and Trumbore 1997)."""
    first, second, start = b - a, c - a, origin - a
    across = np.cross(ray, second)
    volume = np.sum(first * across, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.sum(start * across, axis=-1) / volume
        turned = np.cross(start, first)
        v = turned @ ray / volume
        along = np.sum(second * turned, axis=-1) / volume
    inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (along > 0)
    return np.where(inside, along, np.inf)
