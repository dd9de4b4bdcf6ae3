"""Places in the scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from flexcal.model.urdf import Frame
from flexcal.studio.scene import MEASURED, TARGET, DraggablePoint, Instrument, RobotView
from flexcal.studio.steps.robot.places import BASE, Place, Triple
from flexcal.studio.window import Window
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    import viser

_BASE = Frame(-1, np.eye(3), np.zeros(3))
_RADIUS = 0.01
"""Of a ball, m."""


class _Drawn(Protocol):
    def remove(self) -> None: ...


class PlaceMarkers:
    """Places on the robot that a window shows, one of which can be dragged; they move with its links.

    Parameters
    ----------
    window : Window
        The window.
    frames : mapping
        Frames of the robot's URDF by name.
    """

    def __init__(self, window: Window, frames: Mapping[str, Frame]):
        self._window, self._frames = window, {**frames, BASE: _BASE}
        self._view: RobotView | None = None
        self._on_links: list[_Drawn] = []
        self._standing: list[_Drawn] = []
        self._handle: DraggablePoint | None = None
        self._instrument: Instrument | None = None

    @property
    def stale(self) -> bool:
        """Whether the robot has been drawn anew, without them."""
        return self._window.robot.view is not self._view

    def show(self, places: Sequence[Place], chosen: int | None, dragged: Callable[[Triple], None]) -> None:
        """Show places instead of those before; the chosen one calls `dragged` with its new place, mm in its frame, while it is dragged."""
        self.remove()
        self._view = view = self._window.robot.view
        if view is None:
            return
        scene = self._window.scene
        for number, place in enumerate(places):
            frame, xyz = self._frames[place.frame], np.array(place.xyz) * MILLIMETRE
            name, label = f"place_{number}", "" if number == chosen else place.title
            instrument = None
            if place.kind == "instrument":
                instrument = Instrument(scene, xyz, label, name=f"/{name}")
                self._standing.append(instrument)
            elif number != chosen:
                self._on_links.append(_ball(scene, view, name, place, frame, xyz))
            if number == chosen:
                self._instrument = instrument
                self._handle = DraggablePoint(
                    scene,
                    view,
                    frame,
                    xyz,
                    lambda at: dragged(_tenths(at)),
                    label=place.title,
                    name=f"{name}_handle",
                )
                self._on_links.append(self._handle)

    def move(self, xyz: Triple, *, handle: bool = True) -> None:
        """Show the chosen place at `xyz`, mm; its handle stays as it is while that is dragged."""
        position = np.array(xyz) * MILLIMETRE
        if self._handle is not None and handle and not self.stale:
            self._handle.xyz = position
        if self._instrument is not None:
            self._instrument.position = position

    def remove(self) -> None:
        """Take them out of the scene; those on a robot that is no longer shown went with it."""
        for drawn in [*self._standing, *(() if self.stale else self._on_links)]:
            drawn.remove()
        self._standing, self._on_links = [], []
        self._handle = self._instrument = None


def _ball(
    scene: viser.SceneApi, view: RobotView, name: str, place: Place, frame: Frame, xyz: np.ndarray
) -> viser.FrameHandle:
    node = f"{view.node(frame.joint)}/{name}"
    root = scene.add_frame(node, show_axes=False, position=frame.rotation @ xyz + frame.translation)
    colour = MEASURED if place.kind == "measured point" else TARGET
    scene.add_icosphere(f"{node}/ball", radius=_RADIUS, color=colour, cast_shadow=False, receive_shadow=False)
    scene.add_label(f"{node}/label", place.title, position=(0, 0, 0.03), anchor="bottom-center")
    return root


def _tenths(metres: np.ndarray) -> Triple:
    x, y, z = (round(float(value) / MILLIMETRE, 1) for value in metres)
    return x, y, z
