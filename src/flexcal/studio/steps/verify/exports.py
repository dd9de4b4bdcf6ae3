"""The calibrated robot for other programs, the report for a customer and the accuracy certificate."""

from __future__ import annotations

from typing import Any

from flexcal.errors import FlexcalError
from flexcal.jobs.result_files import RESULTS
from flexcal.studio.commands import CommandRun, command_line
from flexcal.studio.project import CALIBRATION, VERIFICATION
from flexcal.studio.steps.verify.certificate_form import CertificateForm
from flexcal.studio.steps.verify.export_formats import ExportFormat, complete_formats, export_formats
from flexcal.studio.steps.verify.particulars import Particulars
from flexcal.studio.window import Place, Step, Window, command_text, file_link, paragraph

_SMALL = 0.01
"""Error, mm, that an exported file may have without a warning."""
_CUSTOMER = "customer.html"


class Exports(Step):
    """A format and its command line; the customer's report and the certificate with their particulars; what they wrote, as links."""

    title = "Export"

    def __init__(self, window: Window):
        super().__init__(window)
        self._formats: list[ExportFormat] = []
        self._certificate: CertificateForm | None = None
        self._told = ""
        self._shown: object = None

    def open(self) -> None:
        """Add the places of formats, report and certificate, and the particulars."""
        gui = self.window.gui
        self._place = Place(gui)
        with gui.add_folder("Report for the customer"):
            self._particulars = Particulars(self.window, self._show_lines)
            self._report_place = Place(gui)
        with gui.add_folder("Accuracy certificate"):
            self._certificate_place = Place(gui)

    def refresh(self) -> None:
        """Show formats and links anew where files have changed."""
        stamp = self.window.project.stamp()
        if stamp == self._shown:
            return
        self._shown = stamp
        with self._place.anew():
            try:
                self._formats = export_formats(self.window.project)
            except FlexcalError as problem:
                self.window.gui.add_html(paragraph(self.window.project.told(str(problem)), "bad"))
                return
            self._add_formats()
        with self._report_place.anew():
            self._add_report()
        with self._certificate_place.anew():
            self._certificate = CertificateForm(self.window, self._particulars, self._show_anew)

    def _add_formats(self) -> None:
        window, gui = self.window, self.window.gui
        offered = {each.name: each for each in self._formats if not each.refusal}
        names = tuple(offered)
        default = "urdf" if "urdf" in offered else names[0]
        choice = gui.add_dropdown(
            "Format", names, initial_value=window.choices.among("format", names, default)
        )
        told = gui.add_html("")
        window.button(
            "Export the robot",
            lambda: window.command(offered[choice.value].arguments, self._tell_loss),
            main=True,
        )
        self._outcome = gui.add_html(self._told)
        gui.add_html(self._links())
        for each in self._formats:
            if each.refusal:
                gui.add_html(paragraph(f"not offered: {each.name}: {each.refusal}", "faint"))

        def show() -> None:
            format = offered[choice.value]
            window.choices.put("format", format.name)
            told.content = paragraph(format.summary) + _line(format.arguments)

        choice.on_update(lambda _: window.post(show))
        show()

    def _tell_loss(self, run: CommandRun) -> None:
        """What the file does not carry, as the command's document says."""
        self._told = _loss(run.document, complete_formats(self.window.project))
        self._show_anew(run)

    def _show_anew(self, _: CommandRun) -> None:
        """Show the links anew at the refresh that follows a command, whatever kinds of files it wrote."""
        self._shown = None

    def _links(self) -> str:
        folder = self.window.project.folder
        names = [name for each in self._formats for name in each.written(folder)]
        return "".join(file_link(name, f"open {name}") for name in names)

    def _add_report(self) -> None:
        window, gui = self.window, self.window.gui
        folder = VERIFICATION if (window.project.folder / VERIFICATION / RESULTS).is_file() else CALIBRATION
        gui.add_html(
            paragraph(
                f"Two sheets of A4 from the folder {folder}: errors before and after, and their uncertainty. Measuring device and "
                "robot have serial numbers. What is left empty is a line "
                "to fill in by hand."
            )
        )
        self._report = lambda: ("report", folder, "--customer", *self._particulars.options)
        self._report_line = gui.add_html(_line(self._report()))
        window.button("Write the customer's report", lambda: window.command(self._report(), self._show_anew))
        if (window.project.folder / folder / _CUSTOMER).is_file():
            gui.add_html(file_link(f"{folder}/{_CUSTOMER}", f"open {folder}/{_CUSTOMER}"))

    def _show_lines(self) -> None:
        """Show the command lines with the present particulars."""
        if self._certificate is not None:
            self._report_line.content = _line(self._report())
            self._certificate.show_line()


def _line(arguments: tuple[str, ...]) -> str:
    return command_text(f"$ {command_line(arguments)}")


def _loss(document: dict[str, Any], complete: list[str]) -> str:
    """What the tool is off with an exported file, and which formats would carry what it cannot."""
    error = document.get("tool_error")
    if not error:
        return ""
    off = f"With this file the tool is {error['mean_mm']:.3f} mm off on average and {error['max_mm']:.3f} mm at most"
    if error["max_mm"] < _SMALL:
        return paragraph(f"{off}: the format carries the calibrated robot.", "good")
    lost = ", ".join(term["term"] for term in document.get("lost", []))
    return paragraph(
        f"{off}, because the format cannot carry: {lost or 'all of the geometry'}. Formats that can: {', '.join(complete)}. Or keep "
        "this file and correct the commands (Compensate).",
        "warning",
    )
