"""A point typed as the tracker shows it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import InputError
from flexcal.studio.steps.measure.row_source import RowSource
from flexcal.studio.window import entry_form
from flexcal.units import MILLIMETRE, temperature_fault

if TYPE_CHECKING:
    from flexcal.studio.steps.measure.next_pose import NextPose

_LABELS = ("x / mm", "y / mm", "z / mm")
_TEMPERATURE = "arm / °C"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,2})?", re.ASCII)


def _form(labels: tuple[str, ...]) -> str:
    return entry_form(labels, "Take this point (Enter)")


class TypedSource(RowSource):
    """The point of the next pose, typed in mm."""

    title = "typed"

    def add(self) -> None:
        """Add a field a coordinate, and the button that takes them."""
        self._shown = self._labels
        self._form = self.window.gui.add_html(_form(self._shown))

    def tick(self) -> None:
        """Have other fields where the rows have got other columns."""
        if self._labels != self._shown:
            self._shown = self._labels
            self._form.content = _form(self._shown)

    @property
    def _labels(self) -> tuple[str, ...]:
        """The coordinates, and the temperature of the arm where the rows so far have one."""
        poses = self.measuring.series.poses
        return _LABELS if poses is None or poses.temperature is None else (*_LABELS, _TEMPERATURE)

    def measure_next(self) -> None:
        """Say what is to be done; raises `InputError` where no pose is next."""
        self.window.say(f"type {', '.join(self._shown)} of pose {self._pose().number}, then Enter.")

    def enter(self, texts: Mapping[str, str]) -> None:
        """Take the point; raises `InputError` where it was not typed whole, and where it is not of the next pose."""
        from flexcal.data.poses import DEFAULT_SIGMA, PoseSet
        from flexcal.jobs.guidance import cells_of

        series, pose = self.measuring.series, self._pose()
        position = MILLIMETRE * np.array([[self._number(texts, label, pose.number) for label in _LABELS]])
        if texts.get("of") != pose.key:
            raise InputError(
                "E-STUDIO-044",
                f"the next pose has become pose {pose.number} since this point was begun; take it again if it is of that pose.",
            )
        last = None if series.poses is None else series.poses.subset([len(series.poses) - 1])
        poses = PoseSet(
            q=pose.q[None],
            position=position,
            sigma=np.full((1, 3), DEFAULT_SIGMA),
            torque=None,
            payload=None if pose.payload is None else np.array([pose.payload]),
            target=np.array([series.model.point().name]),
            station=np.array([self.measuring.station]),
            temperature=self._temperature(texts, pose.number),
            pose=np.array([pose.number]),
            sigma_given=False,
        )
        if last is not None:
            poses = replace(poses, target=last.target, sigma=last.sigma, sigma_given=last.sigma_given)
        self.take(cells_of(poses))

    def _pose(self) -> NextPose:
        pose = self.following
        if pose is None:
            raise InputError("E-STUDIO-034", "no pose is next, so the point is of none; choose a pose first.")
        return pose

    def _temperature(self, texts: Mapping[str, str], pose: int) -> np.ndarray | None:
        if _TEMPERATURE not in self._labels:
            return None
        value = self._number(texts, _TEMPERATURE, pose)
        fault = temperature_fault(value)
        if fault:
            raise InputError("E-STUDIO-049", f"{_TEMPERATURE} {fault}")
        return np.array([value])

    def _number(self, texts: Mapping[str, str], label: str, pose: int) -> float:
        text = texts.get(label, "").strip().replace("\N{MINUS SIGN}", "-")
        if not text:
            raise InputError(
                "E-STUDIO-035", f"{label} is empty: type {', '.join(self._labels)} of pose {pose} first."
            )
        if _NUMBER.fullmatch(text) is None:
            raise InputError(
                "E-STUDIO-045", f"{label}: '{text}' is not a number; type it as 534.8619, with a point."
            )
        return float(text)
