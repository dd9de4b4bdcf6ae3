"""Result of a recheck."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexcal.calibration.recheck import (
    LEAST_MATCHED,
    DetectionLimit,
    DriftSum,
    JudgedVisit,
    MovedTool,
    TellingPose,
    detection_limits,
    errors_from_calibration,
    errors_from_reference,
    explaining_alarms,
    judge_visit,
    moved_tool,
    telling_pose,
)
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.jobs.calibration import fitted_points, ignored_columns_remarks, outside_ranges
from flexcal.jobs.inputs import (
    CalibratedRobot,
    is_station_identified,
    reference_temperature,
    with_temperature,
)
from flexcal.jobs.pages import PlottedFolder
from flexcal.jobs.recheck.data_errors import DataErrors, disagreeing_poses, misread_visit
from flexcal.jobs.recheck.document import SHIFT, UNSEEN, drift_block, recheck_block
from flexcal.jobs.recheck.judgement_words import (
    alarm_sentence,
    effect_sentence,
    judgement_sentence,
    telling_sentence,
)
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header
from flexcal.model.kinematics import depends_on_temperature
from flexcal.report.layout import Page
from flexcal.report.pages import RecheckStudy, recheck_page


@dataclass(frozen=True, eq=False, repr=False)
class Recheck(PlottedFolder):
    """Result of `recheck`: whether a robot is as calibrated.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    poses : PoseSet
        The measured points.
    judged : JudgedVisit
        The judgement, against the reference visit where there is one, else against the calibration.
    absolute : JudgedVisit or None
        The judgement against the calibration where there is a reference visit.
    limits : tuple of DetectionLimit
        What the visit finds of shifts of single joints.
    tools : tuple of MovedTool
        How far each suspect moved the tool.
    telling : TellingPose or None
        Pose that would tell the two best suspects apart.
    expected : float
        Expected error of the calibrated robot at these poses, root mean square, m.
    outside : str
        Which poses lie outside the joint ranges of the calibration.
    warm : tuple of str
        Remarks on the temperatures of the visit and of the reference.
    mistake : DataErrors or None
        What is wrong with the data, where that explains the errors.
    fitted : tuple of str
        How many of the points the calibration was fitted to, in words.
    reference_changed : bool
        Whether the reference visit was itself not as calibrated, where this one is.
    becomes_reference : bool
        Whether later visits of a folder are compared with this one.
    again : str or None
        Date under which the same files are stored already, where another was given.
    unmatched : bool
        Whether a reference visit was given that has fewer than four poses in common with this one.
    reference_date : str or None
        Date of the reference visit, where it was one of a folder.
    dates : tuple of str
        Dates of the visits behind `drifts`, this one included.
    drifts : tuple of DriftSum
        Cumulative sums over the stored visits.
    record : RunRecord
        What the result comes from.
    """

    poses: PoseSet
    judged: JudgedVisit
    absolute: JudgedVisit | None
    limits: tuple[DetectionLimit, ...]
    tools: tuple[MovedTool, ...]
    telling: TellingPose | None
    expected: float
    outside: str
    warm: tuple[str, ...] = ()
    mistake: DataErrors | None = None
    fitted: tuple[str, ...] = ()
    reference_changed: bool = False
    becomes_reference: bool = False
    again: str | None = None
    unmatched: bool = False
    reference_date: str | None = None
    dates: tuple[str, ...] = ()
    drifts: tuple[DriftSum, ...] = ()
    record: RunRecord = NOT_RECORDED

    @property
    def verdict(self) -> str:
        """The judgement as a word, as in results.json."""
        return "wrong_reading" if self.mistake is not None else self.judged.verdict

    @property
    def headline(self) -> str:
        """The judgement in a sentence."""
        if self.mistake is not None:
            rest = self.mistake.rest
            return self.mistake.words + (
                "" if rest is None else f"; without that: {judgement_sentence(rest)}"
            )
        own = ""
        if self.fitted and self.judged.as_calibrated and self.judged.test.errors.compared == "calibration":
            own = f"the calibration was fitted to {self.fitted[0]}, so they cannot judge it; measure others: "
        return own + judgement_sentence(self.judged) + effect_sentence(self.judged, self.tools, self.expected)

    def summary(self) -> str:
        """The judgement, what would have been found, and remarks."""
        return "\n".join([self.headline, self.power_sentence, *self.remarks])

    @property
    def power_sentence(self) -> str:
        """Shifts of joints that such a visit finds."""
        seen = [limit for limit in self.limits if limit.found < UNSEEN]
        lost = [limit.subject for limit in self.limits if limit.found >= UNSEEN]
        told = ", ".join(f"{limit.subject} {limit.found * 1e3:.3f}" for limit in seen)
        unit = "mrad" if all(limit.unit == "rad" for limit in seen) else "mrad or mm"
        sentence = (
            f"found with 95 % would be shifts ({unit}) of {told}"
            if seen
            else "no shift of a joint would be found"
        )
        return sentence + (f"; not seen: {', '.join(lost)}" if lost else "")

    @property
    def alarms(self) -> tuple[DriftSum, ...]:
        """Of the cumulative sums, where one passed its limit over several visits, those of subjects whose change explains the visits, the
        most likely first; where the visit itself shows a change, only of what that may be.
        """
        named = {suspect.change.subject for suspect in self.judged.suspects}
        return tuple(
            item
            for item in explaining_alarms(self.drifts)
            if self.judged.as_calibrated or item.subject in named
        )

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """Remarks, one sentence each."""
        judged, errors = self.judged, self.judged.test.errors
        remarks = [*self.poses.notes, *ignored_columns_remarks(self.poses, ("temperature",)), *self.warm]
        if self.again is not None:
            remarks.append(
                f"the same files are the visit of {self.again} already, which keeps its date; take it out of visits.json to give another"
            )
        if self.outside:
            remarks.append(self.outside)
        if judged.instrument == "declared":
            remarks.append(
                "the place of the instrument was fitted to these poses, which takes six of their coordinates; a shift of a vertical first "
                "joint, or another that only turns or moves the whole, cannot be seen then"
            )
        noise = float(np.sqrt(np.trace(errors.own) / len(errors.own)))
        if telling := telling_sentence(judged, self.telling, noise):
            remarks.append(telling)
        if judged.verdict == "instrument_moved" and any(limit.found >= UNSEEN for limit in self.limits):
            remarks.append(
                "a point that is fixed to the robot's base, measured with the others, tells a moved instrument from a shift of a joint "
                "that only turns or moves the whole"
            )
        if self.absolute is not None and not self.absolute.as_calibrated and judged.as_calibrated:
            remarks.append(
                "since the reference visit nothing changed; against the calibration itself: "
                + judgement_sentence(self.absolute)
            )
        if self.unmatched:
            remarks.append(
                f"fewer than {LEAST_MATCHED} poses are those of the reference visit (joint positions within 0.0001 rad, as commanded, not "
                "as read), so the visit is compared with the calibrated model"
            )
        elif errors.compared == "calibration":
            remarks.append(
                "compared with the calibrated model, whose own errors count; a reference visit to the same poses after the calibration "
                "(--reference) makes the test sharper, for they cancel"
            )
        elif errors.noise == "calibration":
            remarks.append(
                "the scatter is that of the calibration, which may contain errors of its model; a reference visit that measures every pose "
                "three times tells the robot's own, and makes the test sharper"
            )
        if self.absolute is not None and self.absolute.as_calibrated and not judged.as_calibrated:
            remarks.append(self._against_calibration(self.absolute))
        if self.becomes_reference:
            remarks.append(self._as_reference)
        if self.alarms:
            remarks.append(alarm_sentence(self.alarms, self.dates))
        return tuple(remarks)

    def _against_calibration(self, absolute: JudgedVisit) -> str:
        told = f"against the calibration itself the robot is {judgement_sentence(absolute)}"
        if self.reference_changed:
            return f"{told}, and at the reference visit it was not: that visit is what differs; make this one the reference (--reference)"
        return f"{told}: what changed since the reference visit is less than that comparison shows"

    @property
    def _as_reference(self) -> str:
        absolute = self.absolute or self.judged
        told = "this visit is now the reference: later ones at the same poses are compared with it"
        if absolute.as_calibrated and self.mistake is None:
            return told
        return (
            f"{told}, although against the calibration it is not as calibrated ({judgement_sentence(absolute)}); a later visit that is "
            "as this one is not as calibrated either"
        )

    def _page(self) -> Page:
        return recheck_page(RecheckStudy(self.model.name, self.document()))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {
            **header("recheck"),
            "robot": self.model.name,
            "recheck": self.numbers,
            "drift": drift_block(self.drifts, self.dates, [item.subject for item in self.alarms]),
            "sentence": self.headline,
            "power_sentence": self.power_sentence,
            "remarks": list(self.remarks),
            **self.record.document(),
        }

    @cached_property
    def numbers(self) -> dict[str, Any]:
        """Block `recheck` of the document."""
        return recheck_block(
            self.judged,
            self.absolute,
            self.reference_date,
            self.tools,
            self.telling,
            self.expected,
            self.limits,
        ) | {"verdict": self.verdict, "fitted": list(self.fitted)}


def recheck(
    robot: CalibratedRobot,
    poses: PoseSet,
    *,
    reference: PoseSet | None = None,
    refit: bool = False,
    temperature: float | None = None,
) -> Recheck:
    """Judge by few measured poses whether a robot is as calibrated, and what changed.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    poses : PoseSet
        Joint positions (N, n) in rad or m and measured points (N, 3) in m, about ten.
    reference : PoseSet, optional
        The same poses, or some of them, as measured when the robot was as calibrated; errors of the model cancel then.
    refit : bool
        Whether the instrument stands elsewhere than at the calibration, or at the reference visit.
    temperature : float, optional
        Temperature of the arm, °C, for points that have none; by default that at which the calibrated parameters hold. The reference
        visit has its own.

    Returns
    -------
    Recheck
        Its `verdict`, `headline`, `summary()`, `document()`, `report(path)` and `write(folder)`.

    Raises
    ------
    FlexcalError
        For fewer than four poses, points that the calibration did not measure, measurements that are not of points, and where neither
        the noise of the instrument nor the scatter of the robot is known.

    Examples
    --------
    >>> from flexcal import RobotModel, calibrate, read_poses, recheck
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model)
    >>> robot = calibrate(model, poses.subset(slice(None, None, 13)), terms=["kinematic"]).robot
    >>> recheck(robot, poses.subset(slice(3, 1000, 100))).verdict
    'as_calibrated'
    """
    model = robot.model
    _require(robot, poses)
    poses, warm = with_temperature(robot, poses, temperature)
    if reference is not None:
        _require(robot, reference)
        warm = (*warm, *_reference_temperature(robot, poses, reference))
    unknown = any(not is_station_identified(model, station) for station in poses.stations)

    def against_calibration(rows: PoseSet) -> JudgedVisit | None:
        return judge_visit(
            lambda placed: errors_from_calibration(model, rows, placed=placed), placed=refit or unknown
        )

    def against_reference(rows: PoseSet) -> JudgedVisit | None:
        then = reference
        assert then is not None
        return judge_visit(
            lambda placed: errors_from_reference(model, rows, then, placed=placed),
            placed=refit or set(poses.stations) != set(then.stations),
        )

    absolute = against_calibration(poses)
    assert absolute is not None
    relative = None if reference is None else against_reference(poses)
    judged = relative or absolute
    compared = against_calibration if relative is None else against_reference
    whole = absolute.test.errors.covariance
    expected = float(np.sqrt(3 * np.trace(whole) / len(whole)))
    mistake = None
    if not judged.as_calibrated or judged.instrument == "evident":
        mistake = None if refit or unknown else misread_visit(model, poses, expected, compared)
    if mistake is None and judged.verdict == "recalibrate":
        mistake = disagreeing_poses(judged, poses, compared)
    reference_changed = False
    if reference is not None and absolute.as_calibrated and not judged.as_calibrated:
        then = against_calibration(reference)
        reference_changed = then is not None and not then.as_calibrated
    ranges, targets = robot.blocks["calibration"].ranges, poses.targets
    suspects = judged.suspects
    return Recheck(
        model=model,
        poses=poses,
        judged=judged,
        absolute=absolute if relative is not None else None,
        limits=detection_limits(judged.test, SHIFT),
        tools=tuple(moved_tool(model, ranges, suspect, targets) for suspect in suspects),
        telling=telling_pose(model, ranges, (suspects[0], suspects[1]), targets)
        if len(suspects) > 1
        else None,
        expected=expected,
        outside=outside_ranges(robot, poses.q),
        warm=warm,
        mistake=mistake,
        fitted=fitted_points(robot, poses),
        reference_changed=reference_changed,
        unmatched=reference is not None and relative is None,
    )


def _reference_temperature(robot: CalibratedRobot, poses: PoseSet, reference: PoseSet) -> tuple[str, ...]:
    """What is to be said of a reference visit without temperature; where both visits have none, the visit's own remark says it."""
    if (
        reference.temperature is not None
        or poses.temperature is None
        or not depends_on_temperature(robot.model)
    ):
        return ()
    return (
        f"the reference visit has no temperature and is taken as of {reference_temperature(robot.model):.1f} °C; if the arm was warmer or "
        "colder then, that shows as thermal growth: make a reference visit with its temperature (--reference)",
    )


def _require(robot: CalibratedRobot, poses: PoseSet) -> None:
    unmeasured = [name for name in poses.targets if name not in robot.measured]
    if unmeasured:
        raise FlexcalError(
            "E-RECHECK-006",
            f"no calibration pose measured {' and '.join(unmeasured)}, so its place on the tool is not known; measure "
            f"{' or '.join(robot.measured)}.",
        )
    if len(poses) < 4:
        raise FlexcalError(
            "E-RECHECK-007",
            f"{len(poses)} {'pose tells' if len(poses) == 1 else 'poses tell'} too little; measure four or more, better ten.",
        )
