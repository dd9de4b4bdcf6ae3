"""Residuals of a calibration on the robot, in a table and in measuring order, with one selection for all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.calibration.verification import CALIBRATED
from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.studio.window import Window, error_course, picked_rows
from flexcal.units import MILLIMETRE

_ROWS = 150
"""Rows of the table, the largest errors."""
_MODELS = {
    "calibrated": "calibrated",
    "rigid": "rigid geometry",
    "own": "before, instrument registered",
    "nominal": "before",
}


class ResidualsView:
    """Residuals at the measured poses.

    Parameters
    ----------
    window : Window
        Where they are shown; the table at the current place of its GUI.
    folder : Path
        A folder with points.csv.
    """

    def __init__(self, window: Window, folder: Path):
        from flexcal.jobs.result_files import read_points

        self._window = window
        self._points = read_points(folder, sigma=DEFAULT_SIGMA)
        numbers = np.asarray(self._points.poses.pose)
        several = len(np.unique(numbers)) < len(numbers)
        self._keys = [f"{n}.{row + 1}" if several else f"{n}" for row, n in enumerate(numbers)]
        labels = {_MODELS.get(name, name): name for name in self._points.errors}
        gui = window.gui
        self._labels = labels
        calibrated = _MODELS[CALIBRATED]
        self._model = gui.add_dropdown("Residuals", tuple(labels), initial_value=calibrated)
        self._factor = gui.add_slider("Exaggeration", min=1, max=2000, step=1, initial_value=self._fitting())
        self._table = gui.add_html("")
        self._course = None
        self._model.on_update(lambda _: window.post(self._changed))
        self._factor.on_update(lambda _: window.post(self._stretch))

    def add_course(self) -> None:
        """Add the figure of errors in measuring order at the current place of the GUI."""
        self._course = self._window.gui.add_html("")
        self.refresh()

    def refresh(self) -> None:
        """Show the selected pose everywhere."""
        errors, chosen = self._errors() / MILLIMETRE, self._window.selection.key
        sizes = np.linalg.norm(errors, axis=1)
        if self._course is not None:
            self._course.content = error_course(self._keys, sizes, chosen, word="error")
        largest = np.argsort(-sizes)[:_ROWS].tolist()
        here = self._keys.index(chosen) if chosen in self._keys else None
        if here is not None:
            self._window.robot.pose(self._points.poses.q[here])
        if here is not None and here not in largest:
            largest.append(here)
        rows = {
            self._keys[i]: (f"pose {self._keys[i]}", f"{sizes[i]:.3f}", *(f"{e:+.3f}" for e in errors[i]))
            for i in largest
        }
        self._table.content = picked_rows(("pose", "error / mm", "x", "y", "z"), rows, chosen, height="11em")

    def close(self) -> None:
        """Remove the arrows from the scene."""

    def _errors(self) -> np.ndarray:
        return self._points.errors[self._labels[self._model.value]]

    def _changed(self) -> None:
        self.refresh()

    def _stretch(self) -> None:
        return

    def _fitting(self) -> int:
        """A magnification with which the larger errors are 0.1 m long."""
        size = float(np.percentile(np.linalg.norm(self._points.errors[CALIBRATED], axis=1), 90))
        return int(np.clip(0.1 / max(size, 1e-9), 1, 2000))
