"""A place in the scene, which moves with the link that carries it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.model.kinematics import link_frames
from flexcal.model.parts import rotation_wxyz
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import Frame
from flexcal.studio.steps.robot.places import BASE, Kind, Place, Triple

if TYPE_CHECKING:
    import viser

_COLOURS: dict[Kind, tuple[int, int, int]] = {
    "measured point": (224, 49, 49),
    "payload": (156, 54, 181),
    "instrument": (9, 146, 104),
}
_STILL = Frame(-1, np.eye(3), np.zeros(3))


class PlaceMarker:
    """A ball with its name; with handles to drag it by where `dragged` is given.

    Parameters
    ----------
    scene : viser.SceneApi
        Where it is drawn.
    node : str
        Name of its node.
    place : Place
        The place.
    size : float
        Size of the handles, m.
    dragged : callable, optional
        Called with the new position, mm in the frame of the place, while it is dragged.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        node: str,
        place: Place,
        size: float,
        dragged: Callable[[Triple], None] | None = None,
    ):
        self.place = place
        self._scene = scene
        self._frame = scene.add_frame(node, show_axes=False)
        self._ball = scene.add_icosphere(f"{node}/ball", radius=0.06 * size, color=_COLOURS[place.kind])
        self._label = scene.add_label(f"{node}/ball/name", place.title)
        self._handles: viser.TransformControlsHandle | None = None
        if dragged is not None:
            handles = scene.add_transform_controls(
                f"{node}/handles", scale=size, disable_rotations=True, depth_test=False
            )

            def moved(_: object) -> None:
                x, y, z = (round(1000.0 * float(value), 1) for value in handles.position)
                dragged((x, y, z))

            handles.on_update(moved)
            self._handles = handles
        self.move(place.xyz)

    def move(self, xyz: Triple, *, handles: bool = True) -> None:
        """Show it at `xyz`, mm in its frame; its handles stay where they are while they are dragged."""
        position = np.array(xyz) / 1000.0
        self._ball.position = position
        if handles and self._handles is not None:
            self._handles.position = position

    def follow(self, frame: Frame, rotation: np.ndarray, origin: np.ndarray) -> None:
        """Move its `frame` with the links at `rotation` (N, 3, 3) and `origin` (N, 3), m."""
        turn, shift = (
            (np.eye(3), np.zeros(3)) if frame.joint < 0 else (rotation[frame.joint], origin[frame.joint])
        )
        self._frame.wxyz = rotation_wxyz(turn @ frame.rotation)
        self._frame.position = turn @ frame.translation + shift

    def remove(self) -> None:
        """Take it out of the scene."""
        self._frame.remove()


class PlaceMarkers:
    """Markers of all places of a robot.

    Parameters
    ----------
    scene : viser.SceneApi
        Where they are drawn.
    model : RobotModel
        The robot.
    frames : mapping
        Frames of its URDF by name.
    """

    def __init__(self, scene: viser.SceneApi, model: RobotModel, frames: dict[str, Frame]):
        self._scene, self._model, self._frames = scene, model, frames | {BASE: _STILL}
        self._markers: list[PlaceMarker] = []
        self._q: np.ndarray | None = None

    def show(self, places: list[Place], chosen: int | None, dragged: Callable[[Triple], None]) -> None:
        """Show places instead of those before; the chosen one can be dragged."""
        self.remove()
        size = 0.2 * max(self._model.reach, 0.3)
        self._markers = [
            PlaceMarker(self._scene, f"/place_{i}", place, size, dragged if i == chosen else None)
            for i, place in enumerate(places)
        ]
        self._q = None

    def move(self, index: int, xyz: Triple, *, handles: bool = True) -> None:
        """Show a place at `xyz`, mm."""
        self._markers[index].move(xyz, handles=handles)

    def follow(self, q: np.ndarray | None) -> None:
        """Move them with the robot at joint positions `q` (n,), rad or m."""
        if q is None or (self._q is not None and np.array_equal(q, self._q)) or len(q) != self._model.n:
            return
        rotation, origin = link_frames(self._model, q[None])
        if not np.isfinite(origin).all():
            return
        self._q = q.copy()
        for marker in self._markers:
            marker.follow(self._frames.get(marker.place.frame, _STILL), rotation[0], origin[0])

    def remove(self) -> None:
        """Take them out of the scene."""
        for marker in self._markers:
            marker.remove()
        self._markers = []
