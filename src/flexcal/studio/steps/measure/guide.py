"""Judgements and outlooks, worked out beside the window's thread; rows may arrive meanwhile."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.data.poses import PoseSet
    from flexcal.jobs.experiments import PoseRequest
    from flexcal.jobs.guidance import Finding, GuidedSession, Judgement, Outlook, PoseChoice
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
    """What is known so far of a question: judgements (up to N), and from the outlook on all of it.

    `course` has the predicted error, m, by number of rows; `problem` says why there is no more.
    """

    question: Question
    judgements: tuple[Judgement, ...]
    findings: tuple[Finding, ...] = ()
    outlook: Outlook | None = None
    course: dict[int, float] = field(default_factory=dict)
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
        return Answer(question, self.judgements[: _begin_alike(mine.keys, question.keys)])


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
                self._tell(Answer(answered, tuple(self._known.judgements), problem=problem))
                self._known = _Known()

    def _answer(self, question: Question) -> None:
        known = self._known
        known.begin(question)
        self._tell(Answer(question, tuple(known.judgements)))
        told = time.monotonic()
        while known.judge_next(question):
            if self._latest is not question:
                return
            if len(known.judgements) == len(question.keys) or time.monotonic() - told > _PAUSE:
                self._tell(Answer(question, tuple(known.judgements)))
                told = time.monotonic()
        if question.request is None:
            return
        findings, outlook = known.sessions[-1].findings, known.outlook(question)
        if self._latest is not question:
            return
        answer = Answer(question, tuple(known.judgements), findings, outlook, known.course(question))
        self._tell(answer)
        while known.extend_course(question):
            if self._latest is not question:
                return
        self._tell(replace(answer, course=known.course(question)))


class _Known:
    """Sessions after none, one, two, … of the rows of a question, with their judgements and predicted errors."""

    def __init__(self) -> None:
        self.sessions: list[GuidedSession] = []
        self.judgements: list[Judgement] = []
        self._keys: list[RowKey] = []
        self._of: tuple[object, ...] = ()
        self._choice: tuple[object, PoseChoice] | None = None
        self._errors: dict[int, float] = {}

    def begin(self, question: Question) -> None:
        """Forget what is not of the question."""
        from flexcal.jobs.guidance import GuidedSession

        of = (question.model, question.plan, question.before)
        if not self._of or any(a is not b for a, b in zip(of, self._of, strict=True)):
            self.sessions = [GuidedSession(question.model, question.plan, question.before)]
            self.judgements, self._keys, self._of, self._errors = [], [], of, {}
        same = _begin_alike(self._keys, question.keys)
        del self.sessions[same + 1 :], self.judgements[same:], self._keys[same:]
        self._errors = {count: error for count, error in self._errors.items() if count <= same}

    def judge_next(self, question: Question) -> bool:
        """Judge the next row; False where there is none."""
        done = len(self.judgements)
        if question.rows is None or done == len(question.keys):
            return False
        judgement, session = self.sessions[done].judged(question.rows.subset([done]))
        self.sessions.append(session)
        self.judgements.append(judgement)
        self._keys.append(question.keys[done])
        return True

    def outlook(self, question: Question) -> Outlook:
        """Outlook after all rows."""
        outlook = self._aimed(question, len(self.judgements)).outlook()
        if outlook.is_known:
            self._errors[len(self.judgements)] = float(outlook.p90[0])
        return outlook

    def extend_course(self, question: Question) -> bool:
        """Predict the error after fewer rows, the latest first; False where all are known."""
        for count in range(len(self.judgements) - 1, 0, -1):
            if count not in self._errors:
                outlook = self._aimed(question, count).outlook(1)
                self._errors[count] = float(outlook.p90[0]) if outlook.is_known else np.nan
                return outlook.is_known
        return False

    def course(self, question: Question) -> dict[int, float]:
        """Predicted error, m, by number of rows."""
        return {count: error for count, error in sorted(self._errors.items()) if np.isfinite(error)}

    def _aimed(self, question: Question, count: int) -> GuidedSession:
        """Session after so many rows, which looks for the poses of the question."""
        from flexcal.jobs.guidance import PoseChoice

        request = question.request
        assert request is not None
        if self._choice is None or self._choice[0] is not request:
            self._choice = (request, PoseChoice.of(question.model, request))
            self._errors = {}
        return replace(self.sessions[count], request=request, choice=self._choice[1])


def _begin_alike(first: Sequence[RowKey], second: Sequence[RowKey]) -> int:
    """Number of rows with which both begin."""
    return next(
        (k for k, (a, b) in enumerate(zip(first, second, strict=False)) if a != b),
        min(len(first), len(second)),
    )
