"""Residuals of measured poses on the robot, in a table and in measuring order, with one selection for all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.calibration.verification import CALIBRATED
from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.studio.scene import ResidualArrows
from flexcal.studio.window import Window, error_course, paragraph, picked_rows
from flexcal.units import MILLIMETRE

_ROWS = 150
"""Rows of the table, the largest errors."""
_COLUMNS = ("pose", "error / mm", "x / mm", "y / mm", "z / mm")
_FRAME = paragraph("x, y, z: measured minus predicted, in the instrument's frame.", "faint")
_LENGTH = 0.1
"""Length, m, of the larger arrows at first."""
_MODELS = {
    CALIBRATED: "calibrated",
    "rigid": "rigid geometry",
    "own": "before, instrument and target registered",
    "nominal": "before, instrument registered",
    "declared": "before, as declared",
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
        self._poses = read_points(folder, sigma=DEFAULT_SIGMA).poses
        points, self._arm = read_points(folder, sigma=DEFAULT_SIGMA), read_arm(folder)
        self._errors = points.errors
        numbers = np.asarray(self._poses.pose)
        several = len(np.unique(numbers)) < len(numbers)
        self._keys = [f"{n}.{row + 1}" if several else f"{n}" for row, n in enumerate(numbers)]
        self._labels = {_MODELS.get(name, name): name for name in self._errors}
        gui = window.gui
        self._model = gui.add_dropdown("Model", tuple(self._labels), initial_value=_MODELS[CALIBRATED])
        self._factor = gui.add_slider("Magnify", min=1, max=2000, step=1, initial_value=self._fitting())
        self._table = gui.add_html("")
        self._course = None
        self._arrows: ResidualArrows | None = None
        self._model.on_update(lambda _: window.post(self._changed))
        self._factor.on_update(lambda _: window.post(self._stretch))
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
        if self._arrows is not None:
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
        if self._arrows is not None:
            self._arrows.remove()
            self._arrows = None

    def _draw(self) -> None:
        """Arrows of the model that is chosen; drawings of the arm have a selection of the poses where there are many."""
        self.close()
        vectors = self._arm.errors.get(self._labels[self._model.value])
        self._rows = np.unique(np.linspace(0, len(self._poses) - 1, len(self._arm.tip)).astype(int))
        if vectors is None:
            return
        self._arrows = ResidualArrows(self._window.scene, self._arm.tip, vectors, self._factor.value)
        self._arrows.on_click(
            lambda i: self._window.post(lambda: self._window.selection.pick(self._keys[self._rows[i]]))
        )

    def _changed(self) -> None:
        self._draw()
        self.refresh()

    def _stretch(self) -> None:
        if self._arrows is not None:
            self._arrows.exaggeration = self._factor.value

    def _fitting(self) -> int:
        """A magnification that makes the larger arrows 0.1 m long."""
        size = float(np.percentile(np.linalg.norm(self._errors[CALIBRATED], axis=1), 90))
        return int(np.clip(_LENGTH / max(size, 1e-9), 1, 2000))
