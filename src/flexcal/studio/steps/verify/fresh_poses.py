"""Errors of the calibrated robot at poses that the calibration did not see."""

from __future__ import annotations

from flexcal.jobs.result_files import RESULTS
from flexcal.studio.project import CALIBRATION, CHECKED, VERIFICATION
from flexcal.studio.steps.results import FolderResult
from flexcal.studio.steps.verify.fresh_files import fresh_files
from flexcal.studio.steps.verify.part import Part
from flexcal.studio.window import (
    Place,
    Window,
    paragraph,
    step_link,
)

_NONE = "none"


class FreshPoses(Part):
    """Accuracy at poses measured outside the fit."""

    title = "Verify"

    def __init__(self, window: Window):
        super().__init__(window)
        self._shown: object = None

    def open(self) -> None:
        """Add the choice of the poses, the button, and the place of the result."""
        self._choice = Place(self.window.gui)
        self._result = FolderResult(self.window)

    def refresh(self) -> None:
        """Show the result where files have changed; the selected pose."""
        window = self.window
        stamp = (window.project.stamp(), window.dark)
        if stamp != self._shown:
            self._shown = stamp
            self._show_choice()
            self._result.show(VERIFICATION, self._add_note)
        self._result.refresh()

    def close(self) -> None:
        """Remove the residual arrows."""
        self._result.close()

    def _show_choice(self) -> None:
        window = self.window
        names = fresh_files(window.project)
        with self._choice.anew():
            if not names:
                window.gui.add_html(
                    paragraph(
                        "There are no measured poses that the calibration was not made from. Twenty random ones suffice: their errors tell "
                        f"what the robot does elsewhere. Measure some, or put a table of them here as {CHECKED}.",
                        "warning",
                    )
                    + step_link("Plan", "plan poses to verify on")
                )
                return
            chosen = window.choices.get("fresh", names[0])
            files = window.gui.add_dropdown(
                "Fresh poses", names, initial_value=chosen if chosen in names else names[0]
            )
            files.on_update(lambda _: window.post(lambda: window.choices.put("fresh", files.value)))
            again = " again" if (window.project.folder / VERIFICATION / RESULTS).is_file() else ""
            window.button(
                f"Verify on these poses{again}",
                lambda: window.command(self._arguments(files.value)),
                hint="$ flexcal " + " ".join(self._arguments(files.value)),
                main=True,
            )

    def _arguments(self, file: str) -> tuple[str, ...]:
        return ("verify", "robot.yaml", file, "--estimates", CALIBRATION, "--out", VERIFICATION)

    def _add_note(self) -> None:
        """That the verification is of an earlier calibration, where it is."""
        folder = self.window.project.folder
        estimates = folder / CALIBRATION / "estimates.yaml"
        if estimates.stat().st_mtime_ns > (folder / VERIFICATION / RESULTS).stat().st_mtime_ns:
            self.window.gui.add_html(
                paragraph("The calibration is newer than this verification: verify again.", "warning")
            )
