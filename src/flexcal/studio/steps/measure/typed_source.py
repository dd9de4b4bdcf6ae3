"""A point typed as the tracker shows it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import InputError
from flexcal.studio.steps.measure.row_source import RowSource
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.studio.steps.measure.measuring import Measuring
    from flexcal.studio.window import Window

_SETTLING = 0.4
"""Seconds within which the browser sends a number after the key that ended it; the press of a button arrives at once."""


class TypedSource(RowSource):
    """The point of the next pose, typed in mm."""

    title = "typed"

    def __init__(self, window: Window, measuring: Measuring, refresh: Callable[[], None]):
        super().__init__(window, measuring, refresh)
        self._taken: tuple[float, ...] | None = None
        self._due: float | None = None

    def add(self) -> None:
        """Add a field a coordinate, and the button that takes them."""
        gui = self.window.gui
        self._fields = [gui.add_number(f"{axis} / mm", 0.0, step=0.0001) for axis in "xyz"]
        self.window.button("Take this point (N)", self.measure_next, main=True)

    def measure_next(self) -> None:
        """Take the point, when the last number that was typed has arrived too."""
        self._due = time.monotonic() + _SETTLING

    def tick(self) -> None:
        """Take the point that is due; raises `InputError` where it was not typed, and where no pose is next."""
        if self._due is not None and time.monotonic() >= self._due:
            self._due = None
            self._take_point()

    def _take_point(self) -> None:
        from flexcal.data.poses import DEFAULT_SIGMA, PoseSet
        from flexcal.jobs.guidance import cells_of

        series, pose = self.measuring.series, self.following
        values = tuple(float(field.value) for field in self._fields)
        if pose is None:
            raise InputError("E-STUDIO-034", "no pose is next, so the point is of none; choose a pose first.")
        if values == self._taken or not any(values):
            raise InputError("E-STUDIO-035", f"type x, y and z of pose {pose.number} first.")
        last = None if series.poses is None else series.poses.subset([len(series.poses) - 1])
        model = series.model
        poses = PoseSet(
            q=pose.q[None],
            position=np.array([values]) * MILLIMETRE,
            sigma=np.full((1, 3), DEFAULT_SIGMA),
            torque=None,
            payload=None if pose.payload is None else np.array([pose.payload]),
            target=np.array([model.point().name]),
            station=np.array([self.measuring.station]),
            temperature=None,
            pose=np.array([pose.number]),
            sigma_given=False,
        )
        if last is not None:
            poses = replace(
                poses,
                target=last.target,
                sigma=last.sigma,
                sigma_given=last.sigma_given,
            )
        self.take(cells_of(poses))
        self._taken = values
