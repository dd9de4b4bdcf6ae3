"""Guided measuring: the next pose, a judgement of every row as it comes, and when it is enough."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import PurePath
from typing import Any, cast

from flexcal.errors import FlexcalError, InputError
from flexcal.studio.steps.measure.accuracy_course import accuracy_course
from flexcal.studio.steps.measure.followed_source import FileSource, FolderSource
from flexcal.studio.steps.measure.guide import Answer
from flexcal.studio.steps.measure.imported_source import ImportedSource
from flexcal.studio.steps.measure.measuring import Measuring
from flexcal.studio.steps.measure.next_pose import ORDERS
from flexcal.studio.steps.measure.pose_list import pose_list, row_keys
from flexcal.studio.steps.measure.row_source import RowSource
from flexcal.studio.steps.measure.sentences import next_text, outlook_text, row_text
from flexcal.studio.steps.measure.series import PURPOSES
from flexcal.studio.steps.measure.typed_source import TypedSource
from flexcal.studio.steps.measure.virtual_source import VirtualSource
from flexcal.studio.window import Place, Step, Window, paragraph

_SOURCES: tuple[type[RowSource], ...] = (
    TypedSource,
    FileSource,
    FolderSource,
    ImportedSource,
    VirtualSource,
)


class MeasureStep(Step):
    """Guided measuring: the next pose, a judgement of every row as it comes, and when it is enough."""

    title = "Measure"

    def __init__(self, window: Window):
        super().__init__(window)
        self._measuring: Measuring | None = None
        self._source: RowSource | None = None
        self._is_open = False
        self._stations: tuple[str, ...] = ()
        self._station: Any = None
        self._hotkeys: list[Any] = []
        self._begun = ""

    def open(self) -> None:
        """Add the next pose, the judgement, the source of rows, and the poses with the accuracy on the left."""
        window, gui = self.window, self.window.gui
        if self._measuring is None:
            self._measuring = Measuring(
                window.project,
                window.choices,
                lambda: window.model(estimates=False),
                lambda answer: window.post(lambda: self._answered(answer)),
            )
        self._is_open, self._source, self._stations = True, None, ()
        self._problem = gui.add_html("", visible=False)
        self._body = gui.add_folder(None)
        with self._body:
            self._next = gui.add_html("")
            self._verdict = gui.add_html("")
            self._outlook = gui.add_html("")
            self._moved_button = window.button("", self._move_station)
            self._moved_button.visible = False
            self._add_choice("Rows come from", "row source", [one.title for one in _SOURCES])
            self._place = Place(gui)
            self._station_place = Place(gui)
            self._station_button = window.button(
                "",
                self._move_station,
                hint="after the instrument or the base was moved: the rows from there on stand for themselves",
            )
            self._reason = gui.add_text(
                "Reason", self._begun, hint="why a row is excluded; empty: as it is judged"
            )
            self._exclude_button = window.button("Exclude the last row (X)", self._exclude)
            window.button("Undo (U)", self._undo)
            window.button("Skip the next pose (S)", self._skip)
            with gui.add_folder("What is measured, and until when"):
                self._add_choice("Poses", "purpose", [one.title for one in PURPOSES])
                self._add_choice("Next pose", "pose order", list(ORDERS))
                self._wanted = gui.add_number(
                    "Stop at p90 / mm",
                    window.choices.number("wanted p90", 0.0),
                    min=0.0,
                    step=0.001,
                    hint="0: stop where ten more poses bring less than 5 %",
                )
        self._reason.on_update(lambda _: window.post(self._reason_typed))
        self._wanted.on_update(lambda _: window.post(self._wanted_changed))
        window.figures.show({"Measured": self._add_figures})
        for key, label, action in (
            ("N", "Measure the next pose", self._measure_next),
            ("U", "Undo the last change of the rows", self._undo),
            ("X", "Exclude the row", self._exclude),
            ("S", "Skip the next pose", self._skip),
        ):
            self._add_hotkey(key, label, action)

    def refresh(self) -> None:
        """Show the rows as the files have them."""
        measuring, told = self.measuring, ""
        try:
            measuring.load()
        except FlexcalError as problem:
            told = paragraph(f"{problem} [{problem.code}]", "bad")
        _set(self._problem, told)
        for element, visible in ((self._problem, bool(told)), (self._body, not told)):
            if element.visible != visible:
                element.visible = visible
        if told:
            self.window.robot.ghost(None)
            return
        if self._source is None:
            self._add_source()
        self._show()

    def tick(self) -> None:
        """Take the rows that have come."""
        if self.measuring.is_ready and self._source is not None:
            self._source.tick()

    def enter(self, texts: Mapping[str, str]) -> None:
        """Take a row that was typed."""
        if self.measuring.is_ready and self._source is not None:
            self._source.enter(texts)

    def close(self) -> None:
        """Take the ghost out of the scene, and the hot keys."""
        self._is_open = False
        self.window.robot.ghost(None)
        for command in self._hotkeys:
            command.remove()
        self._hotkeys = []

    @property
    def measuring(self) -> Measuring:
        """The measurement, once the step was open."""
        assert self._measuring is not None
        return self._measuring

    def _answered(self, answer: Answer) -> None:
        if not self.measuring.answered(answer):
            return
        if self._is_open and self.measuring.is_ready:
            self._show()
        if answer.problem is not None and not isinstance(answer.problem, FlexcalError):
            raise answer.problem

    def _show(self) -> None:
        window, measuring = self.window, self.measuring
        window.selection.of(PurePath(measuring.purpose.rows).stem)
        series, chosen = measuring.series, window.selection.key
        following, row = measuring.following(chosen), self._row()
        _set(self._next, next_text(measuring, following))
        _set(self._verdict, row_text(measuring, row))
        outlook = outlook_text(measuring)
        if outlook is not None:
            _set(self._outlook, outlook)
        window.robot.ghost(None if following is None else following.q)
        if row >= 0 and series.poses is not None:
            window.robot.pose(series.poses.q[row])
        listed = pose_list(series, measuring.judgements, following, measuring.skipped, chosen, height="60vh")
        _set(self._list, listed)
        self._show_course()
        self._show_station()
        key = row_keys(series)[row] if row >= 0 else ""
        label = "Exclude the last row (X)" if row == len(series.rows) - 1 else f"Exclude pose {key} (X)"
        if row >= 0 and series.rows[row].excluded:
            label = f"Use pose {key} again (X)"
        if self._exclude_button.label != label:
            self._exclude_button.label = label

    def _show_course(self) -> None:
        answer, outlook = self.measuring.answer, self.measuring.outlook
        if self.measuring.series.purpose.is_check:
            _set(self._course, "")
        elif answer is not None and outlook is not None:
            ahead = outlook.p90.tolist() if outlook.is_known else []
            _set(self._course, accuracy_course(answer.course, ahead, outlook.measured, outlook.desired))

    def _show_station(self) -> None:
        measuring, names = self.measuring, self.measuring.series.model.stations.names
        if names != self._stations:
            self._stations = names
            with self._station_place.anew():
                self._station = self.window.gui.add_dropdown(
                    "Station",
                    names,
                    initial_value=measuring.station,
                    hint="of the rows to come that name none",
                )
            self._station.on_update(lambda _: self.window.post(self._station_chosen))
            self._station_place.visible = len(names) > 1
        if self._station.value != measuring.station:
            self._station.value = measuring.station
        row, count = self._station_row(), len(measuring.series.rows)
        label = "New station for the rows to come"
        if row < count:
            label = f"New station from pose {row_keys(measuring.series)[row]} on"
        for button in (self._station_button, self._moved_button):
            if button.label != label:
                button.label = label
        is_moved = measuring.moved is not None  # then the button is beside the sentence that says so
        self._moved_button.visible, self._station_button.visible = is_moved, not is_moved

    def _station_row(self) -> int:
        """The row from which a new station would be: the selected one, that before which the instrument moved, or the one to come."""
        measuring, chosen = self.measuring, self.window.selection.key
        keys = row_keys(measuring.series)
        if chosen in keys:
            return keys.index(chosen)
        return len(keys) if measuring.moved is None else measuring.moved

    def _row(self) -> int:
        """The selected row, else the last one; −1 for none."""
        keys, chosen = row_keys(self.measuring.series), self.window.selection.key
        return keys.index(chosen) if chosen in keys else len(keys) - 1

    def _add_figures(self) -> None:
        self._course = self.window.gui.add_html("")
        self._list = self.window.gui.add_html("")

    # choices
    def _add_choice(self, label: str, name: str, options: list[str]) -> None:
        element = self.window.gui.add_dropdown(
            label, options, initial_value=self.window.choices.among(name, options)
        )
        element.on_update(lambda _: self.window.post(lambda: self._chosen(name, element.value)))

    def _chosen(self, name: str, value: str) -> None:
        self.window.choices.put(name, value)
        if name != "pose order":
            self._source = None
        self.refresh()

    def _reason_typed(self) -> None:
        self._begun = self._reason.value

    def _wanted_changed(self) -> None:
        self.window.choices.put("wanted p90", float(self._wanted.value))
        self.refresh()

    def _add_source(self) -> None:
        title = self.window.choices.get("row source", _SOURCES[0].title)
        kind = next((one for one in _SOURCES if one.title == title), _SOURCES[0])
        self._source = kind(self.window, self.measuring, self.refresh)
        with self._place.anew():
            self._source.add()

    # actions
    def _measure_next(self) -> None:
        if self._source is not None:
            self._source.measure_next()

    def _undo(self) -> None:
        words = self.measuring.undo()
        self.window.say("nothing to undo." if words is None else f"undone: {words}.")
        self.refresh()

    def _station_chosen(self) -> None:
        if self._station.value != self.measuring.station:
            self.window.choices.put("station", self._station.value)
            self.refresh()

    def _move_station(self) -> None:
        row = self._station_row()
        keys = row_keys(self.measuring.series)
        name = self.measuring.move_station(row)
        since = f"pose {keys[row]} on" if row < len(keys) else "the next row on"
        self.window.say(f"the rows from {since} are of the station '{name}', which robot.yaml has.")
        self.refresh()

    def _exclude(self) -> None:
        measuring, row = self.measuring, self._row()
        if row < 0:
            raise InputError("E-STUDIO-038", "there is no row yet to exclude.")
        key = row_keys(measuring.series)[row]
        if measuring.series.rows[row].excluded:
            measuring.include(row)
            self.window.say(f"pose {key} is used again.")
        else:
            reason = measuring.exclude(row, self._reason.value.strip())
            self._reason.value = ""
            self.window.say(f"pose {key} is excluded: {reason}")
        self.refresh()

    def _skip(self) -> None:
        following = self.measuring.following(self.window.selection.key)
        if following is None or not following.planned:
            raise InputError("E-STUDIO-039", "only planned poses can be skipped.")
        self.measuring.skip(following.number)
        self.window.say(f"pose {following.number} is skipped; pick it in the list to measure it after all.")
        self.refresh()

    def _add_hotkey(self, key: str, label: str, action: Callable[[], None]) -> None:
        command = self.window.gui.add_command(label, hotkey=cast("Any", key))
        command.on_trigger(lambda _: self.window.post(action))
        self._hotkeys.append(command)


def _set(element: Any, content: str) -> None:
    if element.content != content:
        element.content = content
