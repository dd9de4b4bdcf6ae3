"""Comparison of two calibrations."""

from __future__ import annotations

from flexcal.studio.window import Step, paragraph


class CompareStep(Step):
    """Comparison of two calibrations."""

    title = "Compare"

    def open(self) -> None:
        """Add its elements."""
        self.window.gui.add_html(paragraph("not built yet"))
