"""The accuracy certificate: the same targets measured before and after compensation."""

from __future__ import annotations

from collections.abc import Callable

from flexcal.errors import InputError
from flexcal.studio.commands import CommandRun, command_line
from flexcal.studio.project import CALIBRATION, Project
from flexcal.studio.steps.verify.particulars import Particulars
from flexcal.studio.steps.verify.project_tables import project_tables
from flexcal.studio.steps.verify.target_files import target_files
from flexcal.studio.window import Window, command_text, file_link, paragraph

_OUT = "certificate.html"
_FILES = {
    "--targets": "Targets",
    "--before": "Before",
    "--after": "After",
}
_MEANING = "Before: the targets as measured at the nominal commands; after: at the corrected ones."
_AFTER = ("after", "compens", "correct")
_MISSING = (
    "A certificate compares the same targets before and after compensation. It needs a table of targets and two tables of points, x, y, z "
    "with the targets' numbers in the column pose: measured at the nominal commands, and at those that Compensate made of them."
)


class CertificateForm:
    """Tables, the command line that makes the certificate of them, and the certificate; at the current place of a window's GUI.

    Parameters
    ----------
    window : Window
        Where it is shown.
    particulars : Particulars
        Those of the measurement.
    ended : callable
        Called with the command when the certificate is written.
    """

    def __init__(self, window: Window, particulars: Particulars, ended: Callable[[CommandRun], None]):
        self._window, self._particulars, self._ended = window, particulars, ended
        gui, measured = window.gui, measured_files(window.project)
        names = {
            "--targets": target_files(window.project),
            "--before": measured,
            "--after": measured[::-1],
        }
        self._fields = {}
        if len(measured) < 2 or not names["--targets"]:
            gui.add_html(paragraph(_MISSING, "faint"))
            return
        gui.add_html(paragraph(_MEANING, "faint"))
        for option, label in _FILES.items():
            choices = window.choices
            initial = choices.among(f"certificate {option}", names[option], names[option][0])
            field = gui.add_dropdown(label, tuple(names[option]), initial_value=initial)
            field.on_update(lambda _: window.post(self._choose))
            self._fields[option] = field
        self._line = gui.add_html("")
        window.button("Write the certificate", self._write)
        if (window.project.folder / _OUT).is_file():
            gui.add_html(file_link(_OUT, f"open {_OUT}"))
        self.show_line()

    def show_line(self) -> None:
        """Show the command line with the present particulars."""
        if self._fields:
            self._line.content = command_text(f"$ {command_line(self._arguments())}")

    def _arguments(self) -> tuple[str, ...]:
        files = [word for option, field in self._fields.items() for word in (option, field.value)]
        return (
            *("certificate", "robot.yaml", *files, "--estimates", CALIBRATION),
            *("--out", _OUT, *self._particulars.options),
        )

    def _choose(self) -> None:
        for option, field in self._fields.items():
            self._window.choices.put(f"certificate {option}", field.value)
        self.show_line()

    def _write(self) -> None:
        if self._fields["--before"].value == self._fields["--after"].value:
            raise InputError(
                "E-STUDIO-046",
                "the points before and after compensation are those of one table; choose two.",
            )
        self._window.command(self._arguments(), self._told)

    def _told(self, run: CommandRun) -> None:
        self._ended(run)
        before, after = (run.document[key]["ap"] for key in ("before", "after"))
        self._window.say(
            f"{_OUT}: {run.document['targets']} targets, {before['mean_mm']:.3f} mm off on average before and {after['mean_mm']:.3f} mm "
            "after compensation.",
            "good",
        )


def measured_files(project: Project) -> list[str]:
    """Names of tables with points of numbered poses, those whose names say that they come after compensation last."""
    names = project_tables(project, lambda columns: {"pose", "x", "y", "z"} <= columns)
    return sorted(names, key=lambda name: (any(word in name for word in _AFTER), name))
