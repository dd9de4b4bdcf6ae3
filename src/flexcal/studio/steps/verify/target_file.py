"""Commands for a file of targets."""

from __future__ import annotations

from typing import Any

from flexcal.studio.commands import CommandRun, command_line
from flexcal.studio.project import CALIBRATION
from flexcal.studio.window import Window, command_text, file_link, paragraph, table

_OUT = "commands.csv"
_LISTED = 50


class TargetFile:
    """A file of targets, the command line that compensates it, and what came out.

    Parameters
    ----------
    window : Window
        Where it is shown, at the current place of its GUI.
    names : list of str
        The files.
    """

    def __init__(self, window: Window, names: list[str]):
        self._window = window
        gui = window.gui
        if not names:
            gui.add_html(
                paragraph(
                    "There is no table of targets in the folder: put one there, with the column pose, and q1, q2, … (nominal commands, "
                    "rad or m) or x, y, z (m, base frame), with qw, qx, qy, qz where the orientation matters.",
                    "faint",
                )
            )
            return
        self._file = gui.add_dropdown("Targets", names, initial_value=window.choices.among("targets", names))
        self._line = gui.add_html("")
        window.button("Compensate the file", self._run)
        self._told = gui.add_html(_links(window))
        self._file.on_update(lambda _: window.post(self._changed))
        self._changed()

    def _arguments(self) -> tuple[str, ...]:
        return (
            "compensate",
            "robot.yaml",
            self._file.value,
            "--estimates",
            CALIBRATION,
            "--out",
            _OUT,
        )

    def _changed(self) -> None:
        self._window.choices.put("targets", self._file.value)
        self._line.content = command_text(f"$ {command_line(self._arguments())}")

    def _run(self) -> None:
        self._window.command(self._arguments(), self._ended)

    def _ended(self, run: CommandRun) -> None:
        self._told.content = _outcome(run.document) + _links(self._window)


def _links(window: Window) -> str:
    return file_link(_OUT, f"open {_OUT}") if (window.project.folder / _OUT).is_file() else ""


def _outcome(document: dict[str, Any]) -> str:
    before = document["error_before_mm"]
    parts = [
        paragraph(
            f"Commands for {document['compensated']} of {document['targets']} targets. With the nominal commands the tool would be "
            f"{before['mean_mm']:.3f} mm off on average and {before['max_mm']:.3f} mm at most.",
            "good" if not document["refused"] else "warning",
        )
    ]
    if document["refused"]:
        rows = [(str(item["pose"]), item["reason"]) for item in document["refused"][:_LISTED]]
        parts.append(table(("pose", "why it has no command"), rows, height="10em"))
    parts += [paragraph(remark, "warning") for remark in document["remarks"]]
    if document["extrapolated"]:
        rows = [
            (str(item["pose"]), f"{item['predicted_mm']:.3f}") for item in document["extrapolated"][:_LISTED]
        ]
        parts.append(table(("pose beyond", "predicted error / mm"), rows, height="10em"))
    return "".join(parts)
