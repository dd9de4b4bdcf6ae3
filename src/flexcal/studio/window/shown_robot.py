"""The robot of the project in the scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.studio.scene import GHOST, RobotView, Surroundings

if TYPE_CHECKING:
    import viser

    from flexcal.model.robot import RobotModel

_GHOST_OPACITY = 0.35


class ShownRobot:
    """The robot as robot.yaml describes it, without geometric errors, and a ghost of it; all steps show the same.

    Parameters
    ----------
    server : viser.ViserServer
        Server of the scene.
    project : Path
        Folder below which meshes are looked for.

    Attributes
    ----------
    problem : str
        Why there is none; empty where there is one.
    """

    def __init__(self, server: viser.ViserServer, project: Path):
        self._server, self._project = server, project
        self._surroundings = Surroundings(server.scene)
        self._view: RobotView | None = None
        self._ghost: RobotView | None = None
        self.problem = ""

    @property
    def view(self) -> RobotView | None:
        """The robot; None where its files cannot be used."""
        return self._view

    @property
    def q(self) -> np.ndarray | None:
        """Joint positions (n,), rad or m, that it is shown with."""
        return None if self._view is None else self._view.q

    def show(self, model: RobotModel) -> None:
        """Show a robot in place of the one before, in the same joint positions where they fit."""
        if self._view is not None and self._view.model is model:
            return
        q = self.q
        self.clear()
        try:
            self._view = RobotView(self._server.scene, model, self._project)
        except FlexcalError as problem:
            self.problem = str(problem)
            return
        if q is not None and len(q) == model.n:
            self._view.pose(q)
        else:
            self._surroundings.frame(self._server.initial_camera, max(0.3, model.reach))
            self._view.pose(_comfortable(model))

    def pose(self, q: np.ndarray) -> None:
        """Move it to joint positions (n,), rad or m."""
        if self._view is not None:
            self._view.pose(q)

    def ghost(self, q: np.ndarray | None) -> None:
        """Show a ghost at joint positions (n,), rad or m; None hides it."""
        if q is None or self._view is None:
            if self._ghost is not None:
                self._ghost.visible = False
            return
        if self._ghost is None:
            self._ghost = RobotView(
                self._server.scene,
                self._view.model,
                self._project,
                name="/ghost",
                colour=GHOST,
                opacity=_GHOST_OPACITY,
                shapes=self._view.shapes,
            )
        self._ghost.visible = True
        self._ghost.pose(q)

    def clear(self) -> None:
        """Take the robot and its ghost out of the scene."""
        for view in (self._view, self._ghost):
            if view is not None:
                view.remove()
        self._view = self._ghost = None
        self.problem = ""


def _comfortable(model: RobotModel) -> np.ndarray:
    """Zero, or the middle of the joint's range where that leaves zero out."""
    from flexcal.model.kinematics import joint_limits

    lower, upper = joint_limits(model)
    return np.array([(a + b) / 2 if a > 0 or b < 0 else 0.0 for a, b in zip(lower, upper, strict=True)])
