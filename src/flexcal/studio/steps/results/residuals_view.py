"""Residuals of measured poses on the robot, in a table and in measuring order, with one selection for all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.calibration.verification import CALIBRATED, DECLARED, NOMINAL, OWN, RIGID, evenly
from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.studio.window import (
    MagnifiedArrows,
    Window,
    error_course,
    paragraph,
    picked_rows,
    pose_keys,
)
from flexcal.units import MILLIMETRE

_ROWS = 150
"""Rows of the table, the largest errors."""
_COLUMNS = ("pose", "error / mm", "x / mm", "y / mm", "z / mm")
_FRAME = paragraph("x, y, z: measured minus predicted, in the instrument's frame.", "faint")
_MODELS = {
    CALIBRATED: "calibrated",
    RIGID: "rigid geometry",
    OWN: "before, instrument and target registered",
    NOMINAL: "before, instrument registered",
    DECLARED: "before, as declared",
}


class ResidualsView:
    """Residuals at the measured poses: arrows on the robot, measured minus predicted, a table and a figure.

    Parameters
    ----------
    window : Window
        Where they are shown; the table at the current place of its GUI.
    folder : Path
        A folder with points.csv and arm.npz.
    table : str
        Name of the table that the poses were measured in, without ending.
    """

    def __init__(self, window: Window, folder: Path, table: str):
        from flexcal.jobs.result_files import read_arm, read_points

        self._window, self._of = window, table
        points, self._arm = read_points(folder, sigma=DEFAULT_SIGMA), read_arm(folder)
        self._poses, self._errors = points.poses, points.errors
        self._keys = pose_keys(self._poses.pose.tolist())
        self._labels = {_MODELS.get(name, name): name for name in self._errors}
        gui = window.gui
        self._model = gui.add_dropdown("Model", tuple(self._labels), initial_value=_MODELS[CALIBRATED])
        self._arrows = MagnifiedArrows(window, np.linalg.norm(self._errors[CALIBRATED], axis=1), 2000)
        self._table = gui.add_html("")
        self._course = None
        self._model.on_update(lambda _: window.post(self._changed))
        self._draw()

    def add_course(self) -> None:
        """Add the figure of errors in measuring order at the current place of the GUI."""
        self._course = self._window.gui.add_html("")
        self.refresh()

    def refresh(self) -> None:
        """Show the selected pose everywhere."""
        self._window.selection.of(self._of)
        errors, chosen = (
            self._errors[self._labels[self._model.value]] / MILLIMETRE,
            self._window.selection.key,
        )
        sizes = np.linalg.norm(errors, axis=1)
        if self._course is not None:
            self._course.content = error_course(self._keys, sizes, chosen, word="error")
        largest = np.argsort(-sizes)[:_ROWS].tolist()
        here = self._keys.index(chosen) if chosen in self._keys else None
        if here is not None:
            self._window.robot.pose(self._poses.q[here])
            if here not in largest:
                largest.insert(0, here)
        shown = np.flatnonzero(self._rows == here) if here is not None else []
        self._arrows.highlight(int(shown[0]) if len(shown) else None)
        rows = {
            self._keys[i]: (f"pose {self._keys[i]}", f"{sizes[i]:.3f}", *(f"{e:+.3f}" for e in errors[i]))
            for i in largest
        }
        history = "" if here is None else self._history(here)
        self._table.content = history + picked_rows(_COLUMNS, rows, chosen, height="11em") + _FRAME

    def _history(self, row: int) -> str:
        """Errors of one pose from the robot as it was to the calibrated one."""
        ordered = [(label, name) for name, label in _MODELS.items() if name in self._errors][::-1]
        told = [
            f"{label} {np.linalg.norm(self._errors[name][row]) / MILLIMETRE:.3f}" for label, name in ordered
        ]
        return paragraph(f"pose {self._keys[row]}, error / mm: {' → '.join(told)}")

    def close(self) -> None:
        """Remove the arrows from the scene."""
        self._arrows.remove()

    def _draw(self) -> None:
        """Arrows of the model that is chosen; drawings of the arm have a selection of the poses where there are many."""
        vectors = self._arm.errors.get(self._labels[self._model.value])
        self._rows = evenly(len(self._poses), len(self._arm.tip))
        if vectors is None:
            self._arrows.remove()
        else:
            self._arrows.show(
                self._arm.tip, vectors, lambda i: self._window.selection.pick(self._keys[self._rows[i]])
            )

    def _changed(self) -> None:
        self._draw()
        self.refresh()
