from .distinct_files import require_distinct
from .experiment_files import (
    FREQUENCY_PLAN,
    common_plan,
    example_robot,
    plan_files,
    read_fitting_plan,
    read_responses,
    robot_file,
)
from .provenance import robot_origin
from .stored_model import (
    TARGETS,
    TARGETS_BETWEEN,
    CalibratedRobot,
    calibrated_robot,
    found_station,
    measured_points,
    stored_estimates,
    unmeasured_remark,
)

__all__ = [
    "FREQUENCY_PLAN",
    "TARGETS",
    "TARGETS_BETWEEN",
    "CalibratedRobot",
    "calibrated_robot",
    "common_plan",
    "example_robot",
    "found_station",
    "measured_points",
    "plan_files",
    "read_fitting_plan",
    "read_responses",
    "require_distinct",
    "robot_file",
    "robot_origin",
    "stored_estimates",
    "unmeasured_remark",
]
