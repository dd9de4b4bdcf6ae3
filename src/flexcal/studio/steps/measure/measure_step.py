"""Guided measuring: the next pose, a judgement of every row as it comes, and when it is enough."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from flexcal.errors import FlexcalError, InputError
from flexcal.studio.steps.measure.accuracy_course import accuracy_course
from flexcal.studio.steps.measure.guide import Answer, Guide, Question
from flexcal.studio.steps.measure.next_pose import ORDERS, NextPose, Order, next_pose, orders
from flexcal.studio.steps.measure.pose_card import pose_card
from flexcal.studio.steps.measure.pose_list import TONES, pose_list, row_keys
from flexcal.studio.steps.measure.series import PURPOSES, Purpose, Series, read_pose_plan, stamp
from flexcal.studio.steps.measure.sources import (
    FileSource,
    FolderSource,
    RowSource,
    TypedSource,
    VirtualSource,
)
from flexcal.studio.window import Step, Window, paragraph
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.data.poses import PoseSet
    from flexcal.jobs.experiments import PoseRequest
    from flexcal.jobs.guidance import Judgement, Source

_CANDIDATES = 800
_SOURCES: tuple[type[RowSource], ...] = (TypedSource, FileSource, FolderSource, VirtualSource)


class MeasureStep(Step):
    """Guided measuring: the next pose, a judgement of every row as it comes, and when it is enough."""

    title = "Measure"

    def __init__(self, window: Window):
        super().__init__(window)
        self._series: Series | None = None
        self._answer: Answer | None = None
        self._guide: Guide | None = None
        self._question: Question | None = None
        self._request: tuple[object, PoseRequest | None] = ((), None)
        self._before: tuple[object, PoseSet | None] = ((), None)
        self._plan: tuple[object, PosePlan | None] = ((), None)
        self._read: object = None
        self._is_open = False
        self._hotkeys: list[Any] = []

    # ------------------------------------------------------------------ what sources need
    @property
    def series(self) -> Series:
        """Plan and rows now."""
        assert self._series is not None
        return self._series

    @property
    def following(self) -> NextPose | None:
        """The pose that is to be measured next; None where there is none, or it is not known yet."""
        outlook = None
        if self._answer is not None and self._answer.question is self._question:
            outlook = self._answer.outlook
        return next_pose(self.series, self._order, outlook, self.window.selection.key, self._skipped)

    @property
    def is_complete(self) -> bool:
        """Whether no planned pose is left; never where poses are chosen anywhere."""
        series = self.series
        if self._order == "the best anywhere":
            return False
        return not len(series.open_poses) or (self._order == "as planned" and self.following is None)

    def take(self, rows: Sequence[Mapping[str, str]], source: Source | None = None) -> None:
        """Take rows, texts by column; raises `InputError` for those that do not fit."""
        self.series.append(rows, source)
        self.window.say("")
        if self.window.selection.key is not None:
            self.window.selection.pick(None)
        self.refresh()

    # ------------------------------------------------------------------ the page
    def open(self) -> None:
        """Add the next pose, the judgement, the source of rows, and the poses with the accuracy on the left."""
        from flexcal.files.transaction import recover

        window, gui = self.window, self.window.gui
        recover(window.project.folder)
        self._read, self._is_open = None, True
        self._problem = gui.add_html("", visible=False)
        self._body = gui.add_folder(None)
        purpose = window.choices.get("purpose", PURPOSES[0].title)
        source = window.choices.get("row source", _SOURCES[0].title)
        with self._body:
            self._card = gui.add_html("")
            self._verdict = gui.add_html("")
            self._outlook = gui.add_html("")
            titles = [one.title for one in _SOURCES]
            self._source_choice = gui.add_dropdown(
                "Rows come from", titles, initial_value=source if source in titles else titles[0]
            )
            self._place = gui.add_folder(None)
            self._reason = gui.add_text(
                "Reason to exclude", "", hint="kept with the row; empty: the judgement's words"
            )
            self._exclude_button = window.button("Exclude the last row (X)", self._exclude)
            window.button("Undo (U)", self._undo)
            self._skip_button = window.button("Skip the next pose (S)", self._skip)
            with gui.add_folder("What is measured"):
                purposes = [one.title for one in PURPOSES]
                self._purpose_choice = gui.add_dropdown(
                    "Poses", purposes, initial_value=purpose if purpose in purposes else purposes[0]
                )
                self._order_choice = gui.add_dropdown("Order", ORDERS, initial_value=self._order_chosen())
                self._wanted = gui.add_number(
                    "Stop at p90 / mm (0: where more bring little)",
                    window.choices.get("wanted p90", 0.0),
                    min=0.0,
                    step=0.001,
                )
        self._source_choice.on_update(lambda _: window.post(self._source_changed))
        self._purpose_choice.on_update(lambda _: window.post(self._purpose_changed))
        self._order_choice.on_update(lambda _: window.post(self._order_changed))
        self._wanted.on_update(lambda _: window.post(self._wanted_changed))
        window.figures.show({"Measured": self._add_figures})
        for key, label, action in (
            ("N", "Measure the next pose", self._next),
            ("U", "Undo the last change of the rows", self._undo),
            ("X", "Exclude the row", self._exclude),
            ("S", "Skip the next pose", self._skip),
        ):
            self._add_hotkey(key, label, action)
        self._source: RowSource | None = None
        if self._guide is None:
            self._guide = Guide(lambda answer: window.post(lambda: self._answered(answer)))

    def refresh(self) -> None:
        """Show the rows as the files have them."""
        try:
            self._load()
        except FlexcalError as problem:
            self._series = None
            self._set(self._problem, paragraph(f"{problem} [{problem.code}]", "bad"))
        self._problem.visible = self._series is None
        self._body.visible = self._series is not None
        if self._series is None:
            self.window.robot.ghost(None)
            return
        if self._source is None:
            self._add_source()
        self._ask()
        self._show()

    def tick(self) -> None:
        """Take the rows that have come."""
        if self._series is not None and self._source is not None:
            self._source.tick()

    def close(self) -> None:
        """Take the ghost out of the scene, and the hot keys."""
        self._is_open = False
        self.window.robot.ghost(None)
        for command in self._hotkeys:
            command.remove()
        self._hotkeys = []

    # ------------------------------------------------------------------ files and questions
    def _load(self) -> None:
        project, purpose = self.window.project, self._purpose
        if not project.robot_file.is_file():
            raise InputError("E-STUDIO-094", "there is no robot.yaml yet: describe the robot in step 1.")
        model = self.window.model(estimates=False)
        now = (purpose, stamp(project, purpose), model)
        if self._read is not None and self._read == now and self._series is not None:
            return
        plan_of = (purpose, now[1][0], model)
        if self._plan[0] != plan_of:
            self._plan = (plan_of, read_pose_plan(project, purpose, model))
        self._series, self._read = Series.read(project, purpose, model, self._plan[1]), now

    def _ask(self) -> None:
        series = self.series
        used = np.flatnonzero(series.used)
        rows = None if series.poses is None or not len(used) else series.poses.subset(used)
        keys = tuple(tuple(series.rows[k].cells.values()) for k in used.tolist())
        before, request = self._known_before(), self._asked_request()
        last = self._question
        if (
            last is not None
            and last.model is series.model
            and last.plan is series.plan
            and last.keys == keys
            and last.before is before
            and last.request is request
        ):
            return
        assert self._guide is not None
        self._question = Question(series.model, series.plan, before, rows, keys, request)
        self._guide.ask(self._question)

    def _asked_request(self) -> PoseRequest | None:
        from flexcal.data.poses import PosePool
        from flexcal.jobs.experiments import PoseRequest

        series = self.series
        if series.purpose.is_check:
            return None
        plan, skipped = series.plan, self._skipped
        pooled = (
            plan is not None and self._order != "the best anywhere" and len(series.open_poses) > len(skipped)
        )
        wanted = float(self._wanted.value) * MILLIMETRE or None
        key = (id(plan) if pooled else None, skipped if pooled else None, wanted, id(series.model))
        if key != self._request[0]:
            candidates: PosePool | int = _CANDIDATES
            if pooled and plan is not None:
                numbers, first = np.unique(plan.numbers, return_index=True)
                kept = ~np.isin(numbers, list(skipped))
                candidates = PosePool(plan.q[first][kept], numbers[kept])
            self._request = (key, PoseRequest(candidates=candidates, desired_error=wanted))
        return self._request[1]

    def _known_before(self) -> PoseSet | None:
        """Rows to calibrate on, beside which those to verify on are judged."""
        series = self.series
        if not series.purpose.is_check:
            return None
        project, purpose = self.window.project, PURPOSES[0]
        key = (stamp(project, purpose), id(series.model))
        if key != self._before[0]:
            other = Series.read(project, purpose, series.model, None)
            poses = None if other.poses is None or not other.used.any() else other.poses.subset(other.used)
            self._before = (key, poses)
        return self._before[1]

    def _answered(self, answer: Answer) -> None:
        if answer.question is not self._question:
            return
        self._answer = answer
        if answer.problem is not None and not isinstance(answer.problem, FlexcalError):
            raise answer.problem
        if self._is_open and self._series is not None:
            self._show()

    # ------------------------------------------------------------------ what is shown
    def _show(self) -> None:
        window, series, following = self.window, self.series, self.following
        judgements = self._judgements()
        keys = row_keys(series)
        chosen = window.selection.key
        row = keys.index(chosen) if chosen in keys else len(keys) - 1
        self._set(self._card, self._card_text(following))
        self._set(self._verdict, self._verdict_text(row, judgements, keys))
        self._set(self._outlook, self._outlook_text())
        window.robot.ghost(None if following is None else following.q)
        if row >= 0 and series.poses is not None:
            window.robot.pose(series.poses.q[row])
        self._set(self._list, pose_list(series, judgements, following, self._skipped, chosen, height="26em"))
        answer = self._answer
        if answer is not None and answer.question is self._question and answer.outlook is not None:
            ahead = answer.outlook.p90.tolist() if answer.outlook.is_known else []
            course = accuracy_course(answer.course, ahead, answer.outlook.measured, answer.outlook.desired)
            self._set(self._course, course)
        elif series.purpose.is_check:
            self._set(self._course, "")
        label = "Exclude the last row (X)" if row == len(keys) - 1 else f"Exclude pose {keys[row]} (X)"
        if row >= 0 and series.rows[row].excluded:
            label = f"Use pose {keys[row]} again (X)"
        if self._exclude_button.label != label:
            self._exclude_button.label = label

    def _judgements(self) -> dict[int, Judgement]:
        answer = self._answer
        if answer is None or answer.question is not self._question:
            return {}
        return dict(zip(np.flatnonzero(self.series.used).tolist(), answer.judgements, strict=False))

    def _card_text(self, following: NextPose | None) -> str:
        series = self.series
        if following is None:
            if series.plan is None and series.purpose.is_check:
                return paragraph(
                    f"no {series.purpose.plan} yet: plan poses to verify on in step 2.", "warning"
                )
            if self.is_complete:
                return paragraph(
                    f"all {len(series.plan or ())} planned poses are measured: go on with step "
                    f"{'5, Verify' if series.purpose.is_check else '4, Calibrate'}, or choose another order for more.", "good",
                )  # fmt: skip
            problem = None if self._answer is None else self._answer.problem
            return (
                paragraph(str(problem), "bad")
                if problem is not None
                else paragraph("choosing the next pose …")
            )
        if series.plan is None:
            place = f"the best one after {len(series.rows)} rows; there is no {series.purpose.plan}"
        else:
            done = len(series.plan) - len(series.open_poses)
            place = f"{done} of {len(series.plan)} planned poses measured"
        return pose_card(series.model, following, place)

    def _verdict_text(self, row: int, judgements: Mapping[int, Judgement], keys: Sequence[str]) -> str:
        series = self.series
        if row < 0:
            return paragraph("no rows yet.", "faint")
        excluded = series.rows[row].excluded
        if excluded:
            return paragraph(f"pose {keys[row]} is excluded: {excluded}", "faint")
        judgement = judgements.get(row)
        if judgement is None:
            problem = None if self._answer is None else self._answer.problem
            return (
                paragraph(str(problem), "bad")
                if problem is not None
                else paragraph(f"judging pose {keys[row]} …")
            )
        return f'<div aria-live="polite">{paragraph(judgement.sentence, TONES[judgement.code])}</div>'

    def _outlook_text(self) -> str:
        answer = self._answer
        if answer is None or answer.question is not self._question or answer.outlook is None:
            return "" if self.series.purpose.is_check else self._outlook.content
        text = paragraph(answer.outlook.sentence, "good" if answer.outlook.is_enough else "plain")
        said = {j.sentence for j in answer.judgements[-1:]}
        return text + "".join(
            paragraph(f.sentence, "warning") for f in answer.findings if f.sentence not in said
        )

    def _add_figures(self) -> None:
        self._course = self.window.gui.add_html("")
        self._list = self.window.gui.add_html("")

    def _set(self, element: Any, content: str) -> None:
        if element.content != content:
            element.content = content

    # ------------------------------------------------------------------ choices
    @property
    def _purpose(self) -> Purpose:
        return next(one for one in PURPOSES if one.title == self._purpose_choice.value)

    @property
    def _order(self) -> Order:
        possible = orders(self.series)
        chosen = cast("Order", self._order_choice.value)
        return chosen if chosen in possible else possible[0]

    @property
    def _skipped(self) -> frozenset[int]:
        return frozenset(self.window.choices.get(f"skipped {self._purpose.rows}", []))

    def _order_chosen(self) -> str:
        chosen = self.window.choices.get("pose order", ORDERS[0])
        return chosen if chosen in ORDERS else ORDERS[0]

    def _source_changed(self) -> None:
        self.window.choices.put("row source", self._source_choice.value)
        self._add_source()

    def _add_source(self) -> None:
        order = self._place.order
        self._place.remove()
        self._source = next(one for one in _SOURCES if one.title == self._source_choice.value)(self)
        with self._body:
            self._place = self.window.gui.add_folder(None, order=order)
        with self._place:
            self._source.add()

    def _purpose_changed(self) -> None:
        self.window.choices.put("purpose", self._purpose_choice.value)
        self._series, self._source = None, None
        self.refresh()

    def _order_changed(self) -> None:
        self.window.choices.put("pose order", self._order_choice.value)
        self.refresh()

    def _wanted_changed(self) -> None:
        self.window.choices.put("wanted p90", float(self._wanted.value))
        self.refresh()

    # ------------------------------------------------------------------ actions
    def _next(self) -> None:
        if self._source is not None:
            self._source.measure_next()

    def _undo(self) -> None:
        words = self.series.table.undo()
        self.window.say("nothing to undo." if words is None else f"undone: {words}.")
        self.refresh()

    def _exclude(self) -> None:
        series, keys = self.series, row_keys(self.series)
        if not keys:
            raise InputError("E-STUDIO-095", "there is no row yet to exclude.")
        chosen = self.window.selection.key
        row = keys.index(chosen) if chosen in keys else len(keys) - 1
        if series.rows[row].excluded:
            series.table.include(row)
            self.window.say(f"pose {keys[row]} is used again.")
        else:
            judgement = self._judgements().get(row)
            reason = self._reason.value.strip()
            if not reason and judgement is not None and not judgement.is_good:
                reason = judgement.sentence
            series.table.exclude(row, reason)
            self._reason.value = ""
            self.window.say(f"pose {keys[row]} is excluded: {reason}")
        self.refresh()

    def _skip(self) -> None:
        following, name = self.following, f"skipped {self._purpose.rows}"
        if following is None or not following.planned:
            raise InputError("E-STUDIO-096", "only planned poses can be skipped.")
        self.window.choices.put(name, sorted({*self._skipped, following.number}))
        self.window.say(f"pose {following.number} is skipped; pick it in the list to measure it after all.")
        self.refresh()

    def _add_hotkey(self, key: str, label: str, action: Callable[[], None]) -> None:
        command = self.window.gui.add_command(label, hotkey=cast("Any", key))
        command.on_trigger(lambda _: self.window.post(action))
        self._hotkeys.append(command)
