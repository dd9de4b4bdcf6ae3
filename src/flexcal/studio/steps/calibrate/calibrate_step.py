"""Identification and calibration."""

from __future__ import annotations

from flexcal.studio.window import Step, paragraph


class CalibrateStep(Step):
    """Identification and calibration."""

    title = "Calibrate"

    def open(self) -> None:
        """Add its elements."""
        self.window.gui.add_html(paragraph("not built yet"))
