"""Accuracy at fresh poses, accuracy map, compensation, export."""

from __future__ import annotations

from flexcal.studio.project import CALIBRATION
from flexcal.studio.steps.verify.compensated_targets import CompensatedTargets
from flexcal.studio.steps.verify.exports import Exports
from flexcal.studio.steps.verify.fresh_poses import FreshPoses
from flexcal.studio.steps.verify.volume_accuracy import VolumeAccuracy
from flexcal.studio.window import Place, Step, Window, heading, paragraph, step_link

_PARTS: tuple[type[Step], ...] = (FreshPoses, VolumeAccuracy, CompensatedTargets, Exports)
_OPEN = "● "


class VerifyStep(Step):
    """What the calibration is worth and is used for: one part at a time, chosen by a button."""

    title = "Verify"

    def __init__(self, window: Window):
        super().__init__(window)
        self._part: Step | None = None

    def open(self) -> None:
        """Add the choice of the part, and the part that was chosen last."""
        gui = self.window.gui
        self._choice = Place(gui)
        self._missing = gui.add_html("", visible=False)
        self._place = Place(gui)
        self._go_to(self.window.choices.get("part", _PARTS[0].title))

    def refresh(self) -> None:
        """Show what is missing, or the part as the folder has it."""
        calibrated = (self.window.project.folder / CALIBRATION / "estimates.yaml").is_file()
        self._missing.visible = not calibrated
        self._missing.content = (
            ""
            if calibrated
            else paragraph(
                f"There is no calibration yet (folder {CALIBRATION}), and hence nothing to verify or to use."
            )
            + step_link("Calibrate", "calibrate first")
        )
        self._place.visible = calibrated
        if self._part is not None and calibrated:
            self._part.refresh()

    def close(self) -> None:
        """Remove what the part has in the scene."""
        if self._part is not None:
            self._part.close()
            self._part = None

    def _go_to(self, title: str) -> None:
        self.close()
        self.window.figures.clear()
        chosen = next((part for part in _PARTS if part.title == title), _PARTS[0])
        self.window.choices.put("part", chosen.title)
        with self._choice.anew():
            self._add_choice(chosen)
        with self._place.anew():
            self.window.gui.add_html(heading(chosen.title))
            self._part = chosen(self.window)
            self._part.open()
        self.refresh()

    def _add_choice(self, chosen: type[Step]) -> None:
        """A button a part; the one that is open is marked."""
        parts = {(_OPEN if part is chosen else "") + part.title: part.title for part in _PARTS}
        choice = self.window.gui.add_button_group("Show", tuple(parts))
        choice.on_click(lambda _: self.window.post(lambda: self._go_to(parts[choice.value])))
