"""Accuracy at fresh poses, accuracy map, compensation, export."""

from __future__ import annotations

from flexcal.studio.window import Step, paragraph


class VerifyStep(Step):
    """Accuracy at fresh poses, accuracy map, compensation, export."""

    title = "Verify"

    def open(self) -> None:
        """Add its elements."""
        self.window.gui.add_html(paragraph("not built yet"))
