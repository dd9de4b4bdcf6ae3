"""A robot in the scene: one frame a link, moved together."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.model.kinematics import link_frames
from flexcal.model.robot import RobotModel
from flexcal.studio.scene.colours import COLLIDING, LINK
from flexcal.studio.scene.link_shapes import LinkShapes
from flexcal.studio.scene.mesh_file import MeshNotDrawn
from flexcal.studio.scene.rotations import quaternions

if TYPE_CHECKING:
    import viser

Colour = tuple[int, int, int]
"""Red, green and blue from 0 to 255."""


class RobotView:
    """A robot, drawn undeflected with its geometric errors.

    Its base is at the origin. With an `opacity` below 1 it is a ghost: one of a pose that the robot does not have. `missing` are the
    meshes that the URDF names and that could not be drawn.

    Parameters
    ----------
    scene : viser.SceneApi
        Where it is drawn.
    model : RobotModel
        Nominal or calibrated.
    project : Path, optional
        Folder below which meshes are looked for; by default that of robot.yaml.
    name : str
        Name of its nodes.
    colour : tuple of int
        Colour of its links.
    opacity : float
        From 0 to 1, opaque.
    shapes : LinkShapes, optional
        Those of another view of the same robot; by default they are read.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        model: RobotModel,
        project: Path | None = None,
        *,
        name: str = "/robot",
        colour: Colour = LINK,
        opacity: float = 1.0,
        shapes: LinkShapes | None = None,
    ) -> None:
        self.model = model
        self.shapes = shapes or LinkShapes.of(model, project or model.path.absolute().parent)
        self._scene, self._colour = scene, colour
        self._root = scene.add_frame(name, show_axes=False)
        self._frames: dict[int, viser.FrameHandle] = {}
        self._meshes: dict[int, viser.MeshHandle] = {}
        self._marked: frozenset[int] = frozenset()
        for joint in range(-1, len(model.joints)):
            self._frames[joint] = scene.add_frame(self.node(joint), show_axes=False)
        for joint, (vertices, faces) in self.shapes.meshes.items():
            self._meshes[joint] = scene.add_mesh_simple(
                f"{self.node(joint)}/mesh", vertices, faces, color=colour, opacity=None if opacity >= 1.0 else opacity,
                flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
        self.q = np.zeros(model.n)
        self.pose(self.q)

    @property
    def missing(self) -> tuple[MeshNotDrawn, ...]:
        """Meshes of the URDF that are not drawn, with reasons."""
        return self.shapes.missing

    @property
    def visible(self) -> bool:
        """Whether it is shown."""
        return self._root.visible

    @visible.setter
    def visible(self, shown: bool) -> None:
        self._root.visible = shown

    def node(self, joint: int) -> str:
        """Name of the node at the frame of a joint's link (−1: the base), below which things move with the link."""
        return f"{self._root.name}/link_{joint + 1}"

    def pose(self, q: np.ndarray) -> None:
        """Move all links to joint positions `q` (n,), rad or m, at once.

        A robot with loops stays as it is where these do not close. Raises `FlexcalError` for another number of joints.
        """
        rotation, origin = link_frames(self.model, np.asarray(q, dtype=float)[None])
        if not np.isfinite(origin).all():
            return
        turns = quaternions(rotation[0])
        self.q = np.array(q, dtype=float)
        with self._scene._owner.atomic():
            for joint, frame in self._frames.items():
                if joint >= 0:
                    frame.wxyz, frame.position = turns[joint], origin[0, joint]

    def mark(self, joints: Iterable[int], colour: Colour = COLLIDING) -> None:
        """Colour the links of `joints` (−1: the base), such as those in a collision, and no others."""
        marked = frozenset(joints)
        for joint in (marked | self._marked) & self._meshes.keys():
            self._meshes[joint].color = colour if joint in marked else self._colour
        self._marked = marked

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()
