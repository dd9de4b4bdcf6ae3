"""A point on a link that is dragged: a measured point, or the payload's centre of mass."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexcal.model.urdf import Frame
from flexcal.studio.scene.colours import SELECTED
from flexcal.studio.scene.robot_view import RobotView
from flexcal.studio.scene.rotations import quaternions

if TYPE_CHECKING:
    import viser


class DraggablePoint:
    """A point in a frame of a robot's link; it moves with the link, and is dragged along the axes of the frame.

    Parameters
    ----------
    scene : viser.SceneApi
        Where it is drawn.
    view : RobotView
        The robot that carries it.
    frame : Frame
        The frame, in the link of its joint.
    xyz : ndarray
        Position (3,), m, in the frame.
    changed : callable
        Called with the position (3,), m, in the frame while it is dragged.
    label : str
        Drawn beside it as plain text.
    name : str
        Name of its nodes below those of the link, such as `point_1`.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        view: RobotView,
        frame: Frame,
        xyz: np.ndarray,
        changed: Callable[[np.ndarray], None],
        *,
        label: str = "",
        name: str = "point",
    ) -> None:
        node = f"{view.node(frame.joint)}/{name}"
        self._root = scene.add_frame(
            node, show_axes=False, wxyz=quaternions(frame.rotation[None])[0], position=frame.translation
        )
        self._handle = scene.add_transform_controls(
            f"{node}/handle", scale=0.12, disable_rotations=True, disable_sliders=True, depth_test=False
        )
        scene.add_icosphere(
            f"{node}/handle/ball", radius=0.012, color=SELECTED, cast_shadow=False, receive_shadow=False
        )
        if label:
            scene.add_label(f"{node}/handle/label", label, position=(0, 0, 0.03), anchor="bottom-center")
        self.xyz = xyz
        self._handle.on_update(lambda _: changed(self.xyz))

    @property
    def xyz(self) -> np.ndarray:
        """Position (3,), m, in the frame; setting it calls nobody."""
        return np.array(self._handle.position)

    @xyz.setter
    def xyz(self, xyz: np.ndarray) -> None:
        self._handle.position = np.asarray(xyz, dtype=float)

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()
