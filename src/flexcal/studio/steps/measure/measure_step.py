"""Guided measuring."""

from __future__ import annotations

from flexcal.studio.window import Step, paragraph


class MeasureStep(Step):
    """Guided measuring."""

    title = "Measure"

    def open(self) -> None:
        """Add its elements."""
        self.window.gui.add_html(paragraph("not built yet"))
