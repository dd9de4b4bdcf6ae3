"""Planned poses in the scene: targets, instrument and lines of sight, working volume."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.scene import BLOCKED, COLLIDING, MEASURED, TARGET, Instrument, Points, box_edges
from flexcal.studio.steps.plan.pose_checks import PoseChecks

if TYPE_CHECKING:
    from collections.abc import Callable

    from flexcal.studio.window import Window


class PoseScene:
    """The targets of planned poses, coloured by their checks, with what sees them.

    Parameters
    ----------
    window : Window
        Where they are drawn.
    checks : PoseChecks
        Targets, collisions, lines of sight.
    working : ndarray or None
        Corners (2, 3), m, of the working volume that the plan is for.
    picked : callable
        Called in the window's thread with the number of a target, from 0, that was clicked.
    """

    def __init__(
        self, window: Window, checks: PoseChecks, working: np.ndarray | None, picked: Callable[[int], None]
    ):
        self._checks, scene = checks, window.scene
        self._nodes: list = []
        self._points = self._instrument = None
        targets = checks.targets
        if targets is not None:
            colours = np.tile(MEASURED, (len(targets), 1))
            colours[~checks.seen] = BLOCKED
            colours[checks.collides] = COLLIDING
            self._points = Points(scene, targets, colours, name="/plan/targets")
            self._points.on_click(lambda number: window.post(lambda: picked(number)))
            self._nodes.append(self._points)
        if checks.instrument is not None:
            self._instrument = Instrument(scene, checks.instrument, "instrument", name="/plan/instrument")
            self._nodes.append(self._instrument)
        if working is not None:
            self._nodes.append(
                scene.add_line_segments(
                    "/plan/working", box_edges(*working), TARGET, thickness=1.5, thickness_units="screen"
                )
            )
        self.select(None)

    def select(self, row: int | None) -> None:
        """Mark one target and draw its line of sight alone; all lines for None."""
        if self._points is not None:
            self._points.highlight(row)
        if self._instrument is not None and self._checks.targets is not None:
            rows = slice(None) if row is None else slice(row, row + 1)
            self._instrument.look_at(self._checks.targets[rows], ~self._checks.seen[rows])

    def close(self) -> None:
        """Take all out of the scene."""
        for node in self._nodes:
            node.remove()
        self._nodes = []
