"""Errors of the calibrated robot at poses that the calibration did not see."""

from __future__ import annotations

from flexcal.errors import FlexcalError
from flexcal.jobs.result_files import RESULTS
from flexcal.studio.project import CALIBRATION, CHECKED, VERIFICATION
from flexcal.studio.steps.residuals import ResidualsView
from flexcal.studio.steps.verify.fresh_files import fresh_files
from flexcal.studio.steps.verify.links import file_link, step_link
from flexcal.studio.steps.verify.part import Part
from flexcal.studio.steps.verify.place import Place
from flexcal.studio.window import ReportFigures, Window, add_sections, add_verdict, paragraph

_NONE = "none"


class FreshPoses(Part):
    """Accuracy at poses measured outside the fit."""

    title = "Verify"

    def __init__(self, window: Window):
        super().__init__(window)
        self._residuals: ResidualsView | None = None
        self._shown: object = None

    def open(self) -> None:
        """Add the choice of the poses, the button, and the place of the result."""
        self._choice = Place(self.window.gui)
        self._result = Place(self.window.gui)

    def refresh(self) -> None:
        """Show the result where files have changed; the selected pose."""
        window = self.window
        stamp = (window.project.stamp(), window.dark)
        if stamp != self._shown:
            self._shown = stamp
            self._show_choice()
            self._show_result()
        if self._residuals is not None:
            self._residuals.refresh()

    def close(self) -> None:
        """Remove the residual arrows."""
        if self._residuals is not None:
            self._residuals.close()
            self._residuals = None

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

    def _show_result(self) -> None:
        from flexcal.jobs.pages import folder_page

        window, folder = self.window, self.window.project.folder / VERIFICATION
        self.close()
        window.figures.clear()
        with self._result.anew():
            if not (folder / RESULTS).is_file():
                return
            try:
                page = folder_page(folder)
            except FlexcalError as problem:
                window.gui.add_html(paragraph(str(problem), "bad"))
                return
            window.gui.add_html(paragraph(page.subtitle))
            if self._is_older(folder):
                window.gui.add_html(
                    paragraph("The calibration is newer than this verification: verify again.", "warning")
                )
            add_verdict(window.gui, page)
            if (folder / "points.csv").is_file():
                with window.gui.add_folder("Residuals"):
                    self._residuals = ResidualsView(window, folder)
            add_sections(window.gui, page)
            window.gui.add_html(file_link(f"{VERIFICATION}/report.html", "open the report"))
        figures = {} if self._residuals is None else {"Poses": self._residuals.add_course}
        if page.figures:
            figures["Figures"] = lambda: self._add_figures(page)
        window.figures.show(figures)

    def _add_figures(self, page) -> None:
        self._figures = ReportFigures(self.window.gui, page.figures, dark=self.window.dark)

    def _is_older(self, folder) -> bool:
        estimates = self.window.project.folder / CALIBRATION / "estimates.yaml"
        return estimates.stat().st_mtime_ns > (folder / RESULTS).stat().st_mtime_ns
