"""Accuracy over the working volume."""

from __future__ import annotations

from flexcal.errors import FlexcalError
from flexcal.jobs.accuracy import MapTable
from flexcal.jobs.calibration import outside_ranges
from flexcal.jobs.inputs import CalibratedRobot, beyond_calibration
from flexcal.studio.commands import command_line
from flexcal.studio.project import CALIBRATION, MAP
from flexcal.studio.steps.verify.fresh_files import fresh_files
from flexcal.studio.steps.verify.map_view import MapView
from flexcal.studio.steps.verify.working_places import working_places
from flexcal.studio.window import Place, Step, Window, command_text, file_link, paragraph

_TABLE = f"{MAP}.csv"
_NONE = "nothing"


class VolumeAccuracy(Step):
    """Where the map is computed and what verifies it; the map in the scene, before and after calibration, cut open."""

    title = "Map"

    def __init__(self, window: Window):
        super().__init__(window)
        self._view: MapView | None = None
        self._asked: object = None
        self._shown: object = None

    def open(self) -> None:
        """Add the places of question and map."""
        self._question = Place(self.window.gui)
        self._result = Place(self.window.gui)

    def refresh(self) -> None:
        """Show the map where its file has changed; the selected pose of it."""
        project = self.window.project
        places, fresh = working_places(project), fresh_files(project)
        if (places, fresh) != self._asked:
            self._asked = (places, fresh)
            self._ask(places, fresh)
        path = project.folder / _TABLE
        stamp = path.stat().st_mtime_ns if path.is_file() else None
        if (stamp, self.window.dark) != self._shown:
            self._shown = (stamp, self.window.dark)
            self._show()
        if self._view is not None:
            self._view.refresh()

    def close(self) -> None:
        """Remove the map from the scene."""
        if self._view is not None:
            self._view.close()
            self._view = None

    def _ask(self, places: dict[str, tuple[str, ...]], fresh: list[str]) -> None:
        window, gui = self.window, self.window.gui
        with self._question.anew():
            choices, names = window.choices, list(places)
            where = gui.add_dropdown("Where", names, initial_value=choices.among("map where", names))
            names = [*fresh, _NONE]
            verified = gui.add_dropdown(
                "Fresh poses", names, initial_value=choices.among("map verified", names)
            )
            line = gui.add_html("")

            def arguments() -> tuple[str, ...]:
                check = () if verified.value == _NONE else ("--verification", verified.value)
                return (
                    *("map", "robot.yaml", "--estimates", CALIBRATION),
                    *places[where.value],
                    *check,
                    *("--out", _TABLE),
                )

            def changed() -> None:
                window.choices.put("map where", where.value)
                window.choices.put("map verified", verified.value)
                line.content = command_text(f"$ {command_line(arguments())}")

            for choice in (where, verified):
                choice.on_update(lambda _: window.post(changed))
            changed()
            window.button("Compute the map", lambda: window.command(arguments()), main=True)

    def _show(self) -> None:
        window, path = self.window, self.window.project.folder / _TABLE
        self.close()
        with self._result.anew():
            if not path.is_file():
                window.gui.add_html(
                    paragraph(
                        "The map predicts the tool's error everywhere from the uncertainty of the calibration; fresh poses verify it.",
                        "faint",
                    )
                )
                return
            estimates = window.project.folder / CALIBRATION / "estimates.yaml"
            try:
                table = MapTable.read(path)
                robot = CalibratedRobot.from_yaml(window.project.robot_file, estimates)
                remark = outside_ranges(robot, table.predicted.q)
                beyond = beyond_calibration(robot, table.predicted.q) > 0
            except FlexcalError as problem:
                window.gui.add_html(paragraph(window.project.told(str(problem)), "bad"))
                return
            if estimates.stat().st_mtime_ns > path.stat().st_mtime_ns:
                window.gui.add_html(
                    paragraph("The calibration is newer than this map: compute it again.", "warning")
                )
            if remark:
                window.gui.add_html(paragraph(remark, "warning"))
            self._view = MapView(window, table, beyond)
            if path.with_suffix(".html").is_file():
                window.gui.add_html(file_link(f"{MAP}.html", "open the page of the map"))
