"""A guided measurement: its rows, what was chosen, and what is known of them so far."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from flexcal.errors import InputError
from flexcal.studio.steps.measure.guide import Answer, Guide, Question
from flexcal.studio.steps.measure.next_pose import ORDERS, NextPose, Order, next_pose, orders
from flexcal.studio.steps.measure.series import PURPOSES, Purpose, Series, read_pose_plan, stamp
from flexcal.studio.steps.measure.stations import current_station, declare_stations, new_station, with_station
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.data.poses import PoseSet
    from flexcal.jobs.experiments import PoseRequest
    from flexcal.jobs.guidance import Finding, Judgement, Outlook, Source
    from flexcal.model.robot import RobotModel
    from flexcal.studio.project import Choices, Project


class Measuring:
    """A guided measurement in a project's folder, whose files are its only state.

    Parameters
    ----------
    project : Project
        The folder.
    choices : Choices
        What was chosen; kept there.
    model : callable
        Gives the robot as described now; raises `InputError` where it cannot.
    tell : callable
        Called in another thread with every answer to the latest question, for `answered`.
    """

    def __init__(
        self,
        project: Project,
        choices: Choices,
        model: Callable[[], RobotModel],
        tell: Callable[[Answer], None],
    ):
        self.project, self.choices = project, choices
        self._model, self._guide = model, Guide(tell)
        self._series: Series | None = None
        self._answer: Answer | None = None
        self._question: Question | None = None
        self._plan: tuple[object, PosePlan | None] = ((), None)
        self._before: tuple[object, PoseSet | None] = ((), None)
        self._request: tuple[object, PoseRequest | None] = ((), None)
        self._read: object = None

    # what was chosen
    @property
    def purpose(self) -> Purpose:
        """What is measured."""
        title = self.choices.get("purpose", PURPOSES[0].title)
        return next((one for one in PURPOSES if one.title == title), PURPOSES[0])

    @property
    def order(self) -> Order:
        """Order of the poses; of those that are possible."""
        possible = orders(self.series)
        chosen = cast("Order", self.choices.get("pose order", ORDERS[0]))
        return chosen if chosen in possible else possible[0]

    @property
    def wanted(self) -> float | None:
        """Predicted error, m, at which to stop; None for where more poses bring little."""
        return self.choices.number("wanted p90", 0.0) * MILLIMETRE or None

    @property
    def skipped(self) -> frozenset[int]:
        """Numbers of planned poses that are left out."""
        kept = self.choices.get(f"skipped {self.purpose.rows}", [])
        return frozenset(number for number in kept if isinstance(number, int))

    # what is known
    @property
    def series(self) -> Series:
        """Plan and rows now."""
        assert self._series is not None
        return self._series

    @property
    def is_ready(self) -> bool:
        """Whether the files could be read."""
        return self._series is not None

    @property
    def answer(self) -> Answer | None:
        """What is known of the present rows; None before anything is."""
        answer = self._answer
        return answer if answer is not None and answer.question is self._question else None

    @property
    def judgements(self) -> dict[int, Judgement]:
        """Judgements so far, by row: of each as it came, or as the rows after it tell."""
        known, series = {} if self.answer is None else self.answer.judgements, self.series
        used = np.flatnonzero(series.used).tolist()
        judged = {used[k]: judgement for k, judgement in sorted(known.items())}
        for one in self.findings:
            row = used[one.row] if one.row < len(used) else -1
            if (one.kind == "outlier" and row in judged and judged[row].is_good) or (
                one.kind == "moved" and row in judged and judged[row].code == "outlier"
            ):
                size = one.size if np.isfinite(one.size) else None
                judged[row] = replace(
                    judged[row], code=one.kind, sentence=one.sentence, error=size, expected=None, p=one.p
                )
        if judged and series.poses is not None:
            last = max(judged)
            whole = judged[last]
            if whole.is_wrong and whole.error is None:  # of all rows of the station, those before it too
                early = [row for row, one in judged.items() if one.code == "too_early" and one.error is None]
                station = series.poses.station
                judged |= {row: whole for row in early if station[row] == station[last]}
        return judged

    @property
    def reached(self) -> int:
        """Number of planned poses with a row in use, at their joint positions, that is not judged wrong."""
        series, judged = self.series, self.judgements
        good = series.used & series.at_plan
        good[[row for row, one in judged.items() if one.is_wrong]] = False
        return len({*series.numbers[good].tolist()})

    @property
    def outlook(self) -> Outlook | None:
        """Outlook after all rows; None before it is known."""
        return None if self.answer is None else self.answer.outlook

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is wrong with the series, as far as it is known."""
        return () if self.answer is None else self.answer.findings

    @property
    def moved(self) -> int | None:
        """Row before which the instrument or the base was moved, as far as it is known."""
        used = np.flatnonzero(self.series.used)
        rows = [int(used[one.row]) for one in self.findings if one.kind == "moved" and one.row < len(used)]
        return min(rows, default=None)

    @property
    def problem(self) -> Exception | None:
        """Why no more is known of the rows."""
        return None if self.answer is None else self.answer.problem

    def following(self, wanted: str | None) -> NextPose | None:
        """The pose to measure next, the `wanted` one (a key) where it has no row in use; None for none, or where it is not known yet."""
        return next_pose(self.series, self.order, self.outlook, wanted, self.skipped)

    @property
    def is_complete(self) -> bool:
        """Whether no planned pose is left; never where poses are chosen anywhere."""
        plan = self.series.plan
        if plan is None or self.order == "the best anywhere":
            return False
        return {*plan.numbers[self.series.open_poses].tolist()} <= self.skipped

    # what is done
    def load(self) -> None:
        """Read the files where they have changed, and have the rows judged; raises `InputError` for files that cannot be used."""
        try:
            self._load()
        except Exception:
            self._series = self._read = None
            raise
        self._ask()

    def answered(self, answer: Answer) -> bool:
        """Take an answer; False where it is to another question."""
        if answer.question is not self._question:
            return False
        self._answer = answer
        return True

    @property
    def station(self) -> str:
        """Station of the rows to come that do not say theirs."""
        return current_station(self.series, self.choices.get("station", ""))

    def take(self, rows: Sequence[Mapping[str, str]], source: Source | None = None) -> list[str]:
        """Append rows, texts by column, and how far their source is read; return stations that are new in robot.yaml.

        Raises `InputError` for rows that do not fit.
        """
        from flexcal.jobs.guidance import in_columns

        series, first = self.series, self.series.model.stations.names[0]
        rows = in_columns(rows, series.table.columns, series.model)
        series.check(rows)
        new = self._declare(cells["station"] for cells in rows if cells.get("station"))
        self.series.table.append(with_station(series.table, rows, self.station, first), source)
        self.load()
        return new

    def move_station(self, row: int) -> str:
        """A new station for the rows from one on, or for those to come where `row` is beyond the last; return its name."""
        series = self.series
        name = new_station(series, row, self.project.robot_file, self.station)
        self._declare([name])
        if row < len(series.rows):
            series.table.move_station(row, name, series.model.stations.names[0])
        self.choices.put("station", "" if row < len(series.rows) else name)
        self.load()
        return name

    def _declare(self, names: Iterable[str]) -> list[str]:
        new = declare_stations(self.project.robot_file, self.series.model, names)
        if new:
            self.load()
        return new

    def undo(self) -> str | None:
        """Take back the last change of the rows, and say it in words; None where there is none."""
        words = self.series.table.undo()
        self.load()
        return words

    def exclude(self, row: int, reason: str) -> str:
        """Exclude a row, without a reason for that of its judgement, and return the reason; raises `InputError` where there is none."""
        judgement = self.judgements.get(row)
        if not reason and judgement is not None and not judgement.is_good:
            reason = judgement.sentence
        self.series.table.exclude(row, reason)
        self.load()
        return reason

    def include(self, row: int) -> None:
        """Use an excluded row again."""
        self.series.table.include(row)
        self.load()

    def skip(self, number: int) -> None:
        """Leave a planned pose out."""
        self.choices.put(f"skipped {self.purpose.rows}", sorted({*self.skipped, number}))
        self.load()

    def _load(self) -> None:
        project, purpose = self.project, self.purpose
        if not project.robot_file.is_file():
            raise InputError("E-STUDIO-037", "there is no robot.yaml yet: describe the robot in step 1.")
        model = self._model()
        now = (purpose, stamp(project, purpose), model)
        if self._series is not None and self._read == now:
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
        question = Question(
            series.model, series.plan, self._known_before(), rows, keys, self._asked_request()
        )
        if self._question is None or not question.is_same_as(self._question):
            last, self._question = self._answer, question
            self._answer = None if last is None else last.for_further(question)
            self._guide.ask(question)

    def _asked_request(self) -> PoseRequest | None:
        """Where the next poses come from; kept while it is the same."""
        from flexcal.data.poses import PosePool
        from flexcal.jobs.experiments import PoseRequest
        from flexcal.jobs.guidance import DEFAULT_CHOICE

        series, plan = self.series, self.series.plan
        if series.purpose.is_check:
            return None
        pooled = plan is not None and self.order != "the best anywhere" and not self.is_complete
        key = (series.model, self.wanted, (plan, self.skipped) if pooled else None)
        if key != self._request[0]:
            candidates = DEFAULT_CHOICE.candidates
            if pooled and plan is not None:
                numbers, first = np.unique(plan.numbers, return_index=True)
                kept = ~np.isin(numbers, list(self.skipped))
                candidates = PosePool(plan.q[first][kept], numbers[kept])
            self._request = (key, PoseRequest(candidates=candidates, desired_error=self.wanted))
        return self._request[1]

    def _known_before(self) -> PoseSet | None:
        """Rows to calibrate on, beside which those to verify on are judged; kept while they are the same."""
        series = self.series
        if not series.purpose.is_check:
            return None
        key = (stamp(self.project, PURPOSES[0]), series.model)
        if key != self._before[0]:
            other = Series.read(self.project, PURPOSES[0], series.model, None)
            poses = None if other.poses is None or not other.used.any() else other.poses.subset(other.used)
            self._before = (key, poses)
        return self._before[1]
