from .another_geometry import single_deviation
from .change_effects import OF_THE_MEASUREMENT, PossibleChange, possible_changes
from .course_likelihood import VisitCourse, visit_courses
from .cumulative_sums import AVERAGE_RUN, DriftSum, ShiftAtVisit, drift_sums
from .detection import DetectionLimit, detection_limits
from .displaced_tool import MovedTool, TellingPose, moved_tool, telling_pose
from .global_test import ALIKE, FALSE_ALARM, VISIT_ALARM, GlobalTest, misfit_of
from .judged_visit import JudgedVisit, Suspect, is_no_warmth, judge_visit
from .pairs_of_changes import FittedPair
from .visit_errors import (
    LEAST_MATCHED,
    Compared,
    VisitErrors,
    errors_from_calibration,
    errors_from_reference,
    planned_errors,
)

__all__ = [
    "ALIKE",
    "AVERAGE_RUN",
    "FALSE_ALARM",
    "LEAST_MATCHED",
    "OF_THE_MEASUREMENT",
    "VISIT_ALARM",
    "Compared",
    "DetectionLimit",
    "DriftSum",
    "FittedPair",
    "GlobalTest",
    "JudgedVisit",
    "MovedTool",
    "PossibleChange",
    "ShiftAtVisit",
    "Suspect",
    "TellingPose",
    "VisitCourse",
    "VisitErrors",
    "detection_limits",
    "drift_sums",
    "errors_from_calibration",
    "errors_from_reference",
    "is_no_warmth",
    "judge_visit",
    "misfit_of",
    "moved_tool",
    "planned_errors",
    "possible_changes",
    "single_deviation",
    "telling_pose",
    "visit_courses",
]
