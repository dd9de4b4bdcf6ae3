"""An accuracy map in the scene, with its numbers."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from flexcal.jobs.accuracy import MapTable, worst_places
from flexcal.studio.scene import AccuracyVolume, ColourScale
from flexcal.studio.steps.verify.legend import legend
from flexcal.studio.window import Window, paragraph, picked_rows, table
from flexcal.units import MILLIMETRE

_KEY = "map-"
"""Beginning of the key of a pose of the map; what follows is its row."""
_BEFORE, _MEAN, _BOUND = "before calibration", "calibrated, mean", "calibrated, 95 % bound"
_BEYOND = "predicted error above three times that near the calibrated poses"
_NO_CUT = "none"
_STEP = 5
"""Of the cutting plane, mm."""


class MapView:
    """An accuracy map as a coloured volume, a legend, the numbers and the worst places.

    Colours are fitted to the errors that are shown, or to those before and after calibration together. The volume is cut open, so that the
    robot in it is seen.

    Parameters
    ----------
    window : Window
        Where it is shown; numbers at the current place of its GUI.
    map : MapTable
        The map.
    beyond : ndarray
        Which places (N,) have a predicted error above three times that near the calibrated poses.
    """

    def __init__(self, window: Window, map: MapTable, beyond: np.ndarray):
        self._window, self._map, self._beyond = window, map, beyond
        predicted = map.predicted
        self._errors = {_MEAN: predicted.mean / MILLIMETRE, _BOUND: predicted.p95 / MILLIMETRE}
        if map.uncalibrated is not None:
            self._errors = {_BEFORE: map.uncalibrated / MILLIMETRE, **self._errors}
        self._worst = worst_places(predicted)
        gui, names = window.gui, tuple(self._errors)
        gui.add_html(paragraph(_sentence(self._errors)))
        gui.add_html(table(("error / mm", "median", "P90", "worst"), _rows(self._errors)))
        choices = window.choices
        self._error = gui.add_dropdown(
            "Colours", names, initial_value=choices.among("map error", names, _MEAN)
        )
        self._legend = gui.add_html("")
        self._shared = gui.add_checkbox(
            "Same colours",
            choices.get("map same colours", False),
            hint="one scale of colours for the errors before and after calibration",
            visible=_BEFORE in self._errors,
        )
        cuts = (_NO_CUT, "x", "y", "z")
        self._axis = gui.add_dropdown("Cut along", cuts, initial_value=choices.among("map cut", cuts, "y"))
        self._position = gui.add_slider(
            "Plane / mm", min=-1, max=1, step=_STEP, initial_value=0, visible=False
        )
        self._flipped = gui.add_checkbox("Other side", True, visible=False)
        self._only = gui.add_checkbox(
            "Only beyond",
            False,
            hint=f"places with a {_BEYOND}",
            visible=bool(beyond.any()),
        )
        self._table = gui.add_html("")
        self._volume = AccuracyVolume(window.scene, predicted.position, self._errors[self._error.value])
        for choice in (self._error, self._shared):
            choice.on_update(lambda _: window.post(self._recolour))
        self._axis.on_update(lambda _: window.post(self._turn))
        for handle in (self._position, self._flipped):
            handle.on_update(lambda _: window.post(self._cut))
        self._only.on_update(lambda _: window.post(self._restrict))
        self._recolour()
        self._turn()

    def refresh(self) -> None:
        """Show the selected pose of the map on the robot."""
        chosen, predicted = self._window.selection.key, self._map.predicted
        rows = {}
        for row in self._worst.tolist():
            place = ", ".join(f"{1000 * value:.0f}" for value in predicted.position[row])
            *errors, bound = (f"{values[row]:.3f}" for values in self._errors.values())
            rows[f"{_KEY}{row}"] = (place, *errors, f"{bound} !" if self._beyond[row] else bound)
            if chosen == f"{_KEY}{row}":
                self._window.robot.pose(predicted.q[row])
        heads = ("worst places x, y, z / mm", *(name.removeprefix("calibrated, ") for name in self._errors))
        marked = paragraph(f"!: {_BEYOND}.", "faint") if self._beyond[self._worst].any() else ""
        self._table.content = picked_rows(heads, rows, chosen) + marked

    def close(self) -> None:
        """Remove the volume from the scene."""
        self._volume.remove()

    def _recolour(self) -> None:
        self._window.choices.put("map error", self._error.value)
        self._window.choices.put("map same colours", self._shared.value)
        errors = self._errors[self._error.value]
        scale = (
            ColourScale.shared(*self._errors.values()) if self._shared.value else ColourScale.fitted(errors)
        )
        self._volume.show(errors, scale)
        self._legend.content = legend(scale, f"error {self._error.value}", "mm")

    def _turn(self) -> None:
        """A plane across another axis, in the middle of the volume."""
        self._window.choices.put("map cut", self._axis.value)
        cut = self._axis.value != _NO_CUT
        self._position.visible = self._flipped.visible = cut
        if not cut:
            self._volume.uncut()
            return
        along = 1000 * self._map.predicted.position[:, "xyz".index(self._axis.value)]
        low, high = (
            _STEP * float(end) for end in (np.floor(along.min() / _STEP), np.ceil(along.max() / _STEP))
        )
        self._position.min, self._position.max = low, high
        self._position.value = _STEP * round((low + high) / 2 / _STEP)
        self._cut()

    def _restrict(self) -> None:
        self._volume.restrict(self._beyond if self._only.value else None)

    def _cut(self) -> None:
        if self._axis.value != _NO_CUT:
            axis = cast("Any", self._axis.value)
            self._volume.cut(axis, MILLIMETRE * self._position.value, flipped=self._flipped.value)


def _rows(errors: dict[str, np.ndarray]) -> list[tuple[str, ...]]:
    return [
        (name, *(f"{value:.3f}" for value in np.quantile(values, [0.5, 0.9, 1.0])))
        for name, values in errors.items()
    ]


def _sentence(errors: dict[str, np.ndarray]) -> str:
    median, most, worst = np.quantile(errors[_MEAN], [0.5, 0.9, 1.0])
    text = (
        f"At {len(errors[_MEAN])} poses the calibrated tool's mean error is {median:.3f} mm at the median, {most:.3f} mm at the P90 and "
        f"{worst:.3f} mm at the worst pose"
    )
    if _BEFORE in errors:
        text += f"; before calibration the tool was off by {np.median(errors[_BEFORE]):.3f} mm at the median"
    return text + "."
