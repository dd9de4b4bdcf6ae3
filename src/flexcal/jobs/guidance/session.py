"""A guided measurement: judges rows as they come, proposes poses, and says when it is enough."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.data.plans import PosePlan
from flexcal.data.poses import PoseSet, concatenate
from flexcal.errors import InputError
from flexcal.jobs.experiments import PoseRequest
from flexcal.jobs.guidance.analysis import Analysis
from flexcal.jobs.guidance.judgement import Finding, Judgement
from flexcal.jobs.guidance.judging import RowJudge
from flexcal.jobs.guidance.outlook import AHEAD, Outlook, Prospect
from flexcal.jobs.guidance.pose_choice import CANDIDATES, PoseChoice
from flexcal.model.robot import RobotModel

DEFAULT_CHOICE = PoseRequest(candidates=CANDIDATES)


@dataclass(frozen=True, eq=False)
class GuidedSession:
    """Rows measured so far with a robot as described; immutable.

    Parameters
    ----------
    model : RobotModel
        Robot with what is known of it without these rows: not calibrated.
    plan : PosePlan, optional
        Poses that are to be measured.
    rows : PoseSet, optional
        Rows (N,) measured so far, in the order of measuring, without those excluded.
    request : PoseRequest
        Where the next poses come from (random ones, or a pool), the working volume, and the `desired_error` at which to stop.
    choice : PoseChoice, optional
        Candidates of the request, where they were drawn before.
    """

    model: RobotModel
    plan: PosePlan | None = None
    rows: PoseSet | None = None
    request: PoseRequest = DEFAULT_CHOICE
    choice: PoseChoice | None = None

    def __post_init__(self) -> None:
        if self.rows is not None:
            _require_points(self.rows)

    def __len__(self) -> int:
        return 0 if self.rows is None else len(self.rows)

    @cached_property
    def analysis(self) -> Analysis | None:
        """Analysis of the rows so far; None without rows."""
        return None if self.rows is None else Analysis.of(self.model, self.rows)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Disturbances of the series that are certain now, the surest first."""
        analysis = self.analysis
        if analysis is None:
            return ()
        far = analysis.consistent.moved
        found = [] if far is None else [Finding("moved", far, int(analysis.rows.pose[far]), np.inf, None)]
        found += [
            Finding("outlier", row, int(analysis.rows.pose[row]), off, None)
            for row, off in analysis.far_off.items()
            if far is None or row < far
        ]
        return (*found, *(Finding.of(analysis, item) for item in analysis.disturbances))

    def judge(self, row: PoseSet) -> Judgement:
        """Judge the next row beside those so far; the session does not change.

        Raises `InputError` for more or fewer rows than one, and for measurements that are not of points.
        """
        return self.judged(row)[0]

    def judged(self, row: PoseSet) -> tuple[Judgement, GuidedSession]:
        """Judgement of the next row, and the session with it; raises `InputError` as `judge` does."""
        if len(row) != 1:
            raise InputError(
                "E-STUDIO-006", f"{len(row)} rows are given to be judged; judge them one by one."
            )
        session = self.with_rows(row)
        return session.last_judgement(self), session

    def last_judgement(self, before: GuidedSession) -> Judgement:
        """Judgement of the last row beside those `before`, the session without it."""
        analysis = self.analysis
        assert analysis is not None
        return RowJudge(self.model, before.analysis, analysis, self.plan).judgement()

    def with_rows(self, rows: PoseSet) -> GuidedSession:
        """Session with further rows; raises `InputError` for measurements that are not of points."""
        _require_points(rows)
        joined = rows if self.rows is None else _joined(self.rows, rows)
        return replace(self, rows=joined, choice=self.choice or self.__dict__.get("candidates"))

    @cached_property
    def candidates(self) -> PoseChoice:
        """Candidates and working poses, drawn at the first call; raises `FlexcalError` where too few poses pass the checks."""
        return self.choice or PoseChoice.of(self.model, self.request)

    def outlook(self, count: int = AHEAD) -> Outlook:
        """The next `count` poses, the error predicted now and after each of them, and whether to stop.

        Raises `FlexcalError` where too few candidates pass the checks.
        """
        return self.prospect().outlook(count, self.request.desired_error)

    def prospect(self, choice: PoseChoice | None = None) -> Prospect:
        """What is known of the robot now, to look ahead with among the poses of a `choice`, the session's own by default.

        Raises `FlexcalError` as `outlook` does.
        """
        choice = choice or self.candidates
        return Prospect.of(
            self.model, choice, self.rows, None if self.analysis is None else self.analysis.estimate
        )

    def next_poses(self, count: int = 1) -> np.ndarray:
        """The next poses (count, n), rad or m, the best first; raises `FlexcalError` as `outlook` does."""
        return self.outlook(count).q


def _joined(before: PoseSet, further: PoseSet) -> PoseSet:
    """Rows of both; poses keep their numbers."""
    joined = concatenate([before, further])
    return replace(joined, pose=np.concatenate([before.pose, further.pose]))


def _require_points(rows: PoseSet) -> None:
    if not rows.located.all():
        raise InputError(
            "E-STUDIO-007",
            "only points x, y, z of an instrument are judged while they are measured; calibrate other measurements when they are complete.",
        )
