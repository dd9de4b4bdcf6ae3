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
)
from flexcal.data.poses import PoseSet
from flexcal.jobs.calibration import (
    ignored_columns_remarks,
)
from flexcal.jobs.pages import PlottedFolder
from flexcal.jobs.recheck.data_errors import DataErrors
from flexcal.jobs.recheck.document import UNSEEN, drift_block, recheck_block
from flexcal.jobs.recheck.judgement_words import (
    effect_sentence,
    judgement_sentence,
    telling_sentence,
)
from flexcal.jobs.recheck.visit_course import CourseOverVisits
from flexcal.jobs.recheck.visit_history import AS_AT_REFERENCE
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header
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
    at_reference : JudgedVisit or None
        The judgement of the reference visit against the calibration, where it or this one differs from that.
    becomes_reference : bool
        Whether later visits of a folder are compared with this one.
    again : str or None
        Date under which the same readings are stored already, where another date or file was given.
    repeated : str or None
        How many of the readings are of a visit before, in words.
    order : tuple of str
        What is to be said of the date of the visit among others.
    kept : int
        Number of visits since the calibration that are stored, this one included.
    succeeded : bool
        Whether another reference visit is of a later date.
    unmatched : bool
        Whether a reference visit was given that has fewer than four poses in common with this one.
    reference_date : str or None
        Date of the reference visit, where it was one of a folder.
    dates : tuple of str
        Dates of the visits behind `drifts`, this one included.
    drifts : tuple of DriftSum
        Cumulative sums over the stored visits.
    course : CourseOverVisits or None
        Since when, and whether at once or more and more, by all stored visits.
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
    at_reference: JudgedVisit | None = None
    becomes_reference: bool = False
    again: str | None = None
    repeated: str | None = None
    order: tuple[str, ...] = ()
    kept: int = 1
    succeeded: bool = False
    unmatched: bool = False
    reference_date: str | None = None
    dates: tuple[str, ...] = ()
    drifts: tuple[DriftSum, ...] = ()
    course: CourseOverVisits | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def verdict(self) -> str:
        """The judgement as a word, as in results.json."""
        if self.mistake is not None:
            return "wrong_reading"
        if self._still_differs and self.judged.verdict == "as_calibrated":
            return AS_AT_REFERENCE
        return self.judged.verdict

    @property
    def probability(self) -> float:
        """That chance makes errors as conspicuous in a robot as calibrated."""
        return self.shown.probability

    @property
    def _differed(self) -> bool:
        """Whether the reference visit was not as calibrated itself."""
        return self.at_reference is not None and not self.at_reference.as_calibrated

    @property
    def _still_differs(self) -> bool:
        """Whether that is so still."""
        return self._differed and self.absolute is not None and not self.absolute.as_calibrated

    @property
    def shown(self) -> JudgedVisit:
        """The judgement whose suspects are what the tool is off by: against the calibration where nothing changed since a reference visit
        that differed from it.
        """
        return self.absolute if self.absolute is not None and self.verdict == AS_AT_REFERENCE else self.judged

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
        told = judgement_sentence(self.judged, self.course)
        effect = effect_sentence(self.shown, self.tools, self.expected)
        if not self._differed or self.absolute is None or self.at_reference is None:
            return own + told + effect
        day = "" if self.reference_date is None else f" of {self.reference_date}"
        then, now = judgement_sentence(self.at_reference), judgement_sentence(self.absolute)
        unchanged = f"nothing changed since the reference visit{day}: {told.replace('as calibrated', 'as it was then')}"
        moved = effect.replace("the tool is off by", "the tool is off from where it was then by")
        if not self._still_differs:
            if self.judged.as_calibrated:
                return f"{now}, and {unchanged}; that visit was not as calibrated ({then})"
            return (
                f"{now}; the reference visit{day} was not: against the calibration {then} then, and since then {told}{moved}; make this "
                "visit the reference (--reference)"
            )
        if self.judged.as_calibrated:
            return f"{unchanged}; against the calibration the robot differed already then, and does now: {now}{effect}"
        return f"since the reference visit{day} {told}{moved}; against the calibration it differed already then: {then}; and now: {now}"

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
    def alarms(self) -> tuple[str, ...]:
        """What drifts, or changed at an earlier visit, where sums over several visits passed their limit or this visit itself shows it;
        empty where a visit's own verdict says all.
        """
        course = self.course
        if course is None:
            return ()
        if self.judged.as_calibrated:
            passed = tuple(item.subject for item in self.drifts if item.gradual)
            return (course.subjects or passed) if passed else ()
        return course.subjects if course.drifting and self.judged.suspects else ()

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """Remarks, one sentence each."""
        judged, errors = self.judged, self.judged.test.errors
        remarks = [*self.poses.notes, *ignored_columns_remarks(self.poses, ("temperature",)), *self.warm]
        if self.again is not None:
            remarks.append(
                f"the same readings are the visit of {self.again} already, which keeps its date; take it out of visits.json to give another"
            )
        if self.repeated is not None:
            remarks.append(self.repeated)
        remarks += self.order
        if self.outside:
            remarks.append(self.outside)
        if judged.instrument == "declared":
            remarks.append(
                "the place of the instrument was fitted to these poses, which takes six of their coordinates; a shift of a vertical first "
                "joint, or another that only turns or moves the whole, cannot be seen then"
            )
        noise = float(np.sqrt(np.trace(errors.own) / len(errors.own)))
        if telling := telling_sentence(self.shown, self.telling, noise):
            remarks.append(telling)
        if judged.verdict == "instrument_moved" and any(limit.found >= UNSEEN for limit in self.limits):
            remarks.append(
                "a point that is fixed to the robot's base, measured with the others, tells a moved instrument from a shift of a joint "
                "that only turns or moves the whole"
            )
        if (
            self.absolute is not None
            and not self.absolute.as_calibrated
            and judged.verdict == "as_calibrated"
            and not self._differed
        ):
            remarks.append(
                "since the reference visit nothing changed; against the calibration itself: "
                + judgement_sentence(self.absolute)
            )
        if self.unmatched:
            remarks.append(
                f"fewer than {LEAST_MATCHED} poses are those of the reference visit (joint positions within 0.0001 rad, as commanded, not "
                "as read), so the visit is compared with the calibrated model"
            )
        elif errors.compared == "calibration" and self.becomes_reference:
            remarks.append(
                "compared with the calibrated model, whose own errors count; in later visits, which are compared with this one, they "
                "cancel, and smaller shifts are found"
            )
        elif errors.compared == "calibration" and not self.succeeded:
            remarks.append(
                "compared with the calibrated model, whose own errors count; a reference visit to the same poses after the calibration "
                "(--reference) makes the test sharper, for they cancel"
            )
        elif errors.compared == "reference" and errors.noise == "calibration":
            remarks.append(
                "the scatter is that of the calibration, which may contain errors of its model; a reference visit that measures every pose "
                "three times tells the robot's own, and makes the test sharper"
            )
        if (
            self.absolute is not None
            and self.absolute.as_calibrated
            and not judged.as_calibrated
            and not self._differed
        ):
            remarks.append(
                f"against the calibration, whose own errors count there: {judgement_sentence(self.absolute)}; a change as small as that "
                "since the reference visit does not show in it"
            )
        if self.becomes_reference and not self.succeeded:
            remarks.append(self._as_reference)
        if self.alarms and self.judged.as_calibrated and self.course is not None:
            remarks.append(self.course.alarm_sentence(self.alarms))
        return tuple(remarks)

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
            "drift": drift_block(self.drifts, self.dates, self.alarms, self.course),
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
            self.at_reference if self._differed else None,
            self.shown.suspects,
            self.reference_date,
            self.tools,
            self.telling,
            self.expected,
            self.limits,
        ) | {"verdict": self.verdict, "fitted": list(self.fitted)}
