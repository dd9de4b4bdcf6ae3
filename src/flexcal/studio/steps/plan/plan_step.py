"""What to measure: poses, frequency experiments, exciting trajectories."""

from __future__ import annotations

from flexcal.studio.window import Step, paragraph


class PlanStep(Step):
    """What to measure: poses, frequency experiments, exciting trajectories."""

    title = "Plan"

    def open(self) -> None:
        """Add its elements."""
        self.window.gui.add_html(paragraph("not built yet"))
