"""Errors of the calibrated robot at poses that the calibration did not see."""

from __future__ import annotations

from flexcal.jobs.result_files import RESULTS
from flexcal.studio.commands import command_line
from flexcal.studio.project import CALIBRATION, CHECKED, VERIFICATION
from flexcal.studio.steps.results import FolderResult, ResultSource
from flexcal.studio.steps.verify.fresh_files import fresh_files
from flexcal.studio.window import (
    Place,
    Step,
    Window,
    paragraph,
    step_link,
)


class FreshPoses(Step):
    """Accuracy at poses measured outside the fit."""

    title = "Verify"

    def __init__(self, window: Window):
        super().__init__(window)
        self._shown: object = None
        self._file = ""
        self._is_asking = False

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
            self._show_result()
        self._result.refresh()

    def close(self) -> None:
        """Remove the residual arrows."""
        self._result.close()

    def _show_choice(self) -> None:
        window = self.window
        names, self._file = fresh_files(window.project), ""
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
            self._file = window.choices.among("fresh", names)
            files = window.gui.add_dropdown("Fresh poses", names, initial_value=self._file)
            files.on_update(lambda _: window.post(lambda: self._choose(files.value)))
            self._buttons = Place(window.gui)
            self._add_button()

    def _choose(self, file: str) -> None:
        self._file = file
        self.window.choices.put("fresh", file)
        if self._is_asking:
            self._add_button()
        else:
            self._tell_button()  # in its place: a press that is on its way must not meet a button that has gone
        self._show_result()

    def _show_result(self) -> None:
        self._result.show(VERIFICATION, self._add_note, chosen=self._file)

    def _add_button(self) -> None:
        self._is_asking = False
        with self._buttons.anew():
            self._button = self.window.button("Verify on these poses", self._ask, main=True)
        self._tell_button()

    def _tell_button(self) -> None:
        """Say on the button what it does now."""
        done = (self.window.project.folder / VERIFICATION / RESULTS).is_file()
        again = " again" if done and self._other_source() is None else ""
        self._button.label = f"Verify on these poses{again}"
        self._button.hint = f"$ {command_line(self._arguments())}"

    def _other_source(self) -> ResultSource | None:
        """What the present verification is of, where that is another table."""
        folder = self.window.project.folder
        source = ResultSource.read(folder / VERIFICATION)
        if source is None or source.names_table(self._file) or source.is_of(folder / self._file):
            return None
        return source

    def _ask(self) -> None:
        """Verify; where that replaces a verification of another table, have it confirmed first."""
        source = self._other_source()
        if source is None:
            self._verify()
            return
        self._is_asking = True
        with self._buttons.anew():
            self.window.gui.add_html(
                paragraph(
                    f"The folder {VERIFICATION} holds the {source.title}. Verifying on {self._file} replaces it; rename the folder to "
                    "keep both.",
                    "warning",
                )
            )
            self.window.button(f"Replace the verification of {source.names}", self._verify, main=True)
            self.window.button("Keep it", self._add_button)

    def _verify(self) -> None:
        self.window.command(self._arguments())

    def _arguments(self) -> tuple[str, ...]:
        return ("verify", "robot.yaml", self._file, "--estimates", CALIBRATION, "--out", VERIFICATION)

    def _add_note(self) -> None:
        """That the verification is of an earlier calibration, where it is."""
        folder = self.window.project.folder
        estimates = folder / CALIBRATION / "estimates.yaml"
        if estimates.stat().st_mtime_ns > (folder / VERIFICATION / RESULTS).stat().st_mtime_ns:
            self.window.gui.add_html(
                paragraph("The calibration is newer than this verification: verify again.", "warning")
            )
