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
_WARM = "typed temperature"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,2})?", re.ASCII)


def _form(labels: tuple[str, ...]) -> str:
    return entry_form(labels, "Take this point (Enter)")


class TypedSource(RowSource):
    """The point of the next pose, typed in mm."""

    title = "typed"

    def add(self) -> None:
        """Add a field a coordinate, the button that takes them, and before the first row whether the arm's temperature is typed too."""
        self._shown = self._labels
        self._form = self.window.gui.add_html(_form(self._shown))
        self._warm = self.window.gui.add_checkbox(
            "Arm / °C too",
            self._is_warm,
            hint="of every row, where the calibration is to tell what heat does to the robot; before the first row",
            visible=self.measuring.series.poses is None,
        )
        self._warm.on_update(
            lambda event: (
                event.client
                and self.window.post(lambda: self.window.choices.put(_WARM, bool(self._warm.value)))
            )
        )

    def tick(self) -> None:
        """Have other fields where the rows have got other columns."""
        begun = self.measuring.series.poses is not None
        if self._warm.visible == begun:
            self._warm.visible = not begun
        if self._labels != self._shown:
            if not begun and self._warm.value != self._is_warm:
                self._warm.value = self._is_warm
            self._shown = self._labels
            self._form.content = _form(self._shown)

    @property
    def _labels(self) -> tuple[str, ...]:
        """The coordinates, and the temperature of the arm where the rows so far have one, or the first is to have one."""
        poses = self.measuring.series.poses
        warm = self._is_warm if poses is None else poses.temperature is not None
        return (*_LABELS, _TEMPERATURE) if warm else _LABELS

    @property
    def _is_warm(self) -> bool:
        """Whether the first row is to have a temperature: by default where robot.yaml has terms that need it."""
        terms = self.measuring.series.model.config.geometry.terms
        named = not isinstance(terms, str) and any(
            term.rpartition(".")[2].startswith("thermal") for term in terms
        )
        return self.window.choices.get(_WARM, named)

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
