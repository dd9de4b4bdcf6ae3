"""Controls of a motion on the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.design.scene import CollisionChecker
from flexcal.studio.scene import Motion, colliding_links

if TYPE_CHECKING:
    from flexcal.studio.window import Window

_PLAY, _PAUSE = "Play", "Pause"


class Player:
    """A button and a time, with which the robot in the scene moves; links that touch are marked.

    Parameters
    ----------
    window : Window
        Where it is added, at the current place of its GUI.
    checker : CollisionChecker
        The robot's bodies.
    repeat : bool
        Whether the motion begins anew at its end.
    """

    def __init__(self, window: Window, checker: CollisionChecker, *, repeat: bool):
        self._window, self._checker, self._repeat = window, checker, repeat
        self._motion: Motion | None = None
        self._button = window.button(_PLAY, self._play, hint="The robot in the scene moves, in real time.")
        self._time = window.gui.add_slider("Time / s", 0.0, 1.0, 0.001, 0.0)
        self._time.on_update(lambda event: event.client and window.post(self._dragged))

    def load(self, time: np.ndarray, q: np.ndarray) -> None:
        """Take joint positions q (N, n) at `time` (N,), s, from 0 on."""
        self.close()
        view = self._window.robot.view
        if view is None:
            return
        self._motion = Motion(view, time, q, repeat=self._repeat)
        self._time.max = round(float(time[-1]), 3)
        self._time.value = 0.0

    def show(self, time: float) -> None:
        """Show the robot as it is at a time, s."""
        if self._motion is not None:
            self._motion.show(time)
            self._follow()

    def tick(self) -> None:
        """Show the time while it plays."""
        if self._motion is None:
            return
        playing = self._motion.playing
        label = _PAUSE if playing else _PLAY
        if self._button.label != label:
            self._button.label = label
            self._follow()
        elif playing:
            self._follow()

    def pause(self) -> None:
        """Stand still."""
        if self._motion is not None:
            self._motion.pause()

    def close(self) -> None:
        """Stand still, and take the marks off the robot."""
        self.pause()
        if self._window.robot.view is not None:
            self._window.robot.view.mark(())

    def _play(self) -> None:
        if self._motion is None:
            return
        if self._motion.playing:
            self._motion.pause()
        else:
            self._motion.start()
        self.tick()

    def _dragged(self) -> None:
        if self._motion is not None:
            self._motion.pause()
            self._motion.show(float(self._time.value))
            self._mark()

    def _follow(self) -> None:
        assert self._motion is not None
        self._time.value = round(self._motion.time, 3)
        self._mark()

    def _mark(self) -> None:
        view = self._window.robot.view
        if view is not None:
            view.mark(colliding_links(self._checker, view.q))
