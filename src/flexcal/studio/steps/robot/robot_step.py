"""The robot: its URDF, measured points, payload and cell."""

from __future__ import annotations

from flexcal.studio.window import Step, paragraph


class RobotStep(Step):
    """The robot: its URDF, measured points, payload and cell."""

    title = "Robot"

    def open(self) -> None:
        """Add its elements."""
        self.window.gui.add_html(paragraph("not built yet"))
