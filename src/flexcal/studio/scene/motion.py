"""A trajectory that a robot in the scene plays."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.studio.scene.robot_view import RobotView

_PERIOD = 0.04
"""Seconds between two postures that are sent to the windows."""


class Motion:
    """Plays joint positions over time in a thread of its own, and ends there or, with `repeat`, begins anew.

    Raises `FlexcalError` for times that do not increase or do not fit the positions.

    Parameters
    ----------
    view : RobotView
        The robot that moves.
    times : ndarray
        Times (samples,), s, increasing.
    q : ndarray
        Joint positions (samples, n), rad or m, between which it moves linearly.
    repeat : bool
        Whether it begins anew at its end.
    shown : callable, optional
        Called with the time, s, of each posture that is shown.
    """

    def __init__(
        self,
        view: RobotView,
        times: np.ndarray,
        q: np.ndarray,
        *,
        repeat: bool = False,
        shown: Callable[[float], None] | None = None,
    ) -> None:
        self.view, self.repeat = view, repeat
        self._times, self._q = np.asarray(times, dtype=float), np.asarray(q, dtype=float)
        if len(self._times) < 2 or len(self._times) != len(self._q) or not (np.diff(self._times) > 0).all():
            raise FlexcalError(
                "E-STUDIO-018",
                f"a motion of {len(self._q)} positions needs as many times, two or more, that increase; "
                f"there are {len(self._times)}.",
            )
        self._shown = shown
        self._time = float(self._times[0])
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def duration(self) -> float:
        """From the first time to the last, s."""
        return float(self._times[-1] - self._times[0])

    @property
    def time(self) -> float:
        """Time of the posture that is shown, s."""
        return self._time

    @property
    def playing(self) -> bool:
        """Whether it moves."""
        return self._thread is not None and self._thread.is_alive()

    def at(self, moment: float) -> np.ndarray:
        """Joint positions (n,) at a time, s, those of the ends before and after."""
        return np.array([np.interp(moment, self._times, column) for column in self._q.T])

    def show(self, moment: float) -> None:
        """Show the posture at a time, s, within the motion."""
        self._time = float(np.clip(moment, self._times[0], self._times[-1]))
        self.view.pose(self.at(self._time))
        if self._shown is not None:
            self._shown(self._time)

    def start(self) -> None:
        """Play on from the time that is shown, or from the beginning where that is the end."""
        self.pause()
        if self._time >= self._times[-1]:
            self._time = float(self._times[0])
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._play, args=(self._stop,), daemon=True)
        self._thread.start()

    def pause(self) -> None:
        """Stand still at the posture that is shown; returns when the thread has ended."""
        self._stop.set()
        thread, self._thread = self._thread, None
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    def _play(self, stop: threading.Event) -> None:
        begun = time.monotonic() - (self._time - self._times[0])
        while not stop.wait(_PERIOD):
            passed = time.monotonic() - begun
            if self.repeat:
                passed %= self.duration
            self.show(self._times[0] + passed)
            if passed >= self.duration:
                return
