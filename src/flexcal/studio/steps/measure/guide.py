"""Judgements and outlooks, worked out beside the window's thread; rows may arrive meanwhile."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.data.poses import PoseSet
    from flexcal.jobs.experiments import PoseRequest
    from flexcal.jobs.guidance import Finding, GuidedSession, Judgement, Outlook, PoseChoice, Prospect
    from flexcal.model.robot import RobotModel

RowKey = tuple[str, ...]
_PAUSE = 0.3
"""Seconds between judgements that are told while many rows are judged, so that the page is not drawn for each of them."""


@dataclass(frozen=True, eq=False)
class Question:
    """Rows to judge, and what to look ahead for.

    Attributes
    ----------
    model, plan
        Robot as described, and the plan of the rows.
    before : PoseSet or None
        Rows of another series that are known already.
    rows : PoseSet or None
        Rows (N,) in use, in the order of measuring.
    keys : tuple
        Content (N,) of every row: judgements of rows that follow the same ones are not worked out again.
    request : PoseRequest or None
        Where next poses come from; None where none are asked for.
    """

    model: RobotModel
    plan: PosePlan | None
    before: PoseSet | None
    rows: PoseSet | None
    keys: tuple[RowKey, ...]
    request: PoseRequest | None

    def is_same_as(self, other: Question) -> bool:
        """Whether its answer is that of another one."""
        mine = (self.model, self.plan, self.before, self.request)
        others = (other.model, other.plan, other.before, other.request)
        return self.keys == other.keys and all(a is b for a, b in zip(mine, others, strict=True))


@dataclass(frozen=True, eq=False)
class Answer:
    """What is known so far of a question: judgements by row, the last row's first, and from the outlook on what that needs of all rows.

    `course` has the predicted error, m, by number of rows; `problem` says why there is no more.
    """

    question: Question
    judgements: Mapping[int, Judgement]
    findings: tuple[Finding, ...] = ()
    outlook: Outlook | None = None
    course: Mapping[int, float] = field(default_factory=dict)
    problem: Exception | None = None

    def for_further(self, question: Question) -> Answer | None:
        """What it tells of another question: the judgements of those rows that begin both; None where the robot or the plan differs."""
        mine = self.question
        if (
            mine.model is not question.model
            or mine.plan is not question.plan
            or mine.before is not question.before
        ):
            return None
        return Answer(question, _of_first(self.judgements, _begin_alike(mine.keys, question.keys)))


class Guide:
    """Answers the latest question in a thread of its own.

    Parameters
    ----------
    tell : callable
        Called in that thread with every answer, again and again as more is known; not with one to a question that is no longer the latest.
    """

    def __init__(self, tell: Callable[[Answer], None]):
        self._tell = tell
        self._changed = threading.Condition()
        self._latest: Question | None = None
        self._known = _Known()
        threading.Thread(target=self._run, daemon=True, name="guide").start()

    def ask(self, question: Question) -> None:
        """Ask a question in place of the one before."""
        with self._changed:
            self._latest = question
            self._changed.notify()

    def _run(self) -> None:
        answered: Question | None = None
        while True:
            with self._changed:
                while self._latest is answered:
                    self._changed.wait()
                answered = self._latest
            assert answered is not None
            try:
                self._answer(answered)
            except Exception as problem:
                self._tell(Answer(answered, dict(self._known.judgements), problem=problem))
                self._known = _Known()

    def _answer(self, question: Question) -> None:
        known = self._known
        known.begin(question)
        known.judge_last(question)
        self._tell(Answer(question, dict(known.judgements)))
        answer = Answer(question, {})
        if question.request is not None and self._latest is question:
            answer = replace(answer, findings=known.findings(question), outlook=known.outlook(question))
        told = -_PAUSE
        while self._latest is question:
            more = known.look_back(question)
            if not more or time.monotonic() - told > _PAUSE:
                self._tell(replace(answer, judgements=dict(known.judgements), course=known.course))
                told = time.monotonic()
            if not more:
                return


class _Known:
    """Judgements and predicted errors of the rows of a question; sessions of all of these and of those looked at last."""

    def __init__(self) -> None:
        self.judgements: dict[int, Judgement] = {}
        self._errors: dict[int, float] = {}
        self._sessions: dict[int, GuidedSession] = {}
        self._keys: tuple[RowKey, ...] = ()
        self._of: tuple[object, ...] = ()
        self._choice: tuple[object, PoseChoice] | None = None

    def begin(self, question: Question) -> None:
        """Forget what is not of the question."""
        of = (question.model, question.plan, question.before)
        alike = bool(self._of) and all(a is b for a, b in zip(of, self._of, strict=True))
        same = _begin_alike(self._keys, question.keys) if alike else 0
        self.judgements = _of_first(self.judgements, same)
        self._errors = {count: error for count, error in self._errors.items() if 0 < count <= same}
        self._sessions = {count: one for count, one in self._sessions.items() if alike and count <= same}
        self._keys, self._of = question.keys, of

    def judge_last(self, question: Question) -> None:
        """Judge the last row, where there is one that is not judged."""
        if question.keys and len(question.keys) - 1 not in self.judgements:
            self._judge(question, len(question.keys))

    def look_back(self, question: Question) -> bool:
        """Judge the latest row that is not judged, or predict the error after it; False where all is known."""
        for count in range(len(question.keys), 0, -1):
            if count - 1 not in self.judgements:
                self._judge(question, count)
                return True
            if question.request is not None and count not in self._errors:
                self._predict(question, count)
                return True
        return False

    def findings(self, question: Question) -> tuple[Finding, ...]:
        """What is wrong with the series of all rows."""
        return self._session(question, len(question.keys)).findings

    def outlook(self, question: Question) -> Outlook:
        """Outlook after all rows."""
        assert question.request is not None
        return self._predict(question, len(question.keys)).outlook(desired=question.request.desired_error)

    @property
    def course(self) -> dict[int, float]:
        """Predicted error, m, by number of rows."""
        return {count: error for count, error in sorted(self._errors.items()) if np.isfinite(error)}

    def _judge(self, question: Question, count: int) -> None:
        """Judge the last of `count` rows."""
        after = self._session(question, count)
        self.judgements[count - 1] = after.last_judgement(self._session(question, count - 1))

    def _session(self, question: Question, count: int) -> GuidedSession:
        """Session after so many rows."""
        from flexcal.jobs.guidance import GuidedSession

        if count not in self._sessions:
            session = GuidedSession(question.model, question.plan, question.before)
            if question.rows is not None and count:
                session = session.with_rows(question.rows.subset(slice(0, count)))
            near = {len(question.keys), count + 1}
            self._sessions = {one: self._sessions[one] for one in self._sessions if one in near} | {
                count: session
            }
        return self._sessions[count]

    def _predict(self, question: Question, count: int) -> Prospect:
        """Predict the error after so many rows; return what it was predicted with."""
        from flexcal.jobs.guidance import PoseChoice

        request = question.request
        assert request is not None
        if self._choice is None or self._choice[0] is not request:
            choice = PoseChoice.of(question.model, request)
            if self._choice is None or not np.array_equal(choice.working, self._choice[1].working):
                self._errors = {}
            self._choice = (request, choice)
        prospect = self._session(question, count).prospect(self._choice[1])
        self._errors[count] = prospect.p90 if prospect.is_known else np.nan
        return prospect


def _of_first(judgements: Mapping[int, Judgement], count: int) -> dict[int, Judgement]:
    """Those of the first `count` rows."""
    return {row: one for row, one in judgements.items() if row < count}


def _begin_alike(first: Sequence[RowKey], second: Sequence[RowKey]) -> int:
    """Number of rows with which both begin."""
    return next(
        (k for k, (a, b) in enumerate(zip(first, second, strict=False)) if a != b),
        min(len(first), len(second)),
    )
