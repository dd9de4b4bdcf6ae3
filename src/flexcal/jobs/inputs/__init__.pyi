from .distinct_files import require_distinct_files
from .experiment_files import (
    FREQUENCY_PLAN,
    common_plan,
    example_robot,
    plan_files,
    read_plan_for_robot,
    read_responses,
    robot_file,
)
from .given_temperature import (
    TEMPERATURE,
    calibrated_temperatures,
    held_at,
    reference_temperature,
    require_temperature,
    temperature_remarks,
    with_temperature,
)
from .misreadings import Misreading, misread_point, other_pose, planned_pose
from .provenance import image_provenance, robot_provenance
from .stored_model import (
    TARGETS,
    TARGETS_BETWEEN,
    CalibratedRobot,
    is_station_identified,
    measured_points,
    stored_estimates,
    unmeasured_lengths_remark,
    unmeasured_targets_remark,
)

__all__ = [
    "FREQUENCY_PLAN",
    "TARGETS",
    "TARGETS_BETWEEN",
    "TEMPERATURE",
    "CalibratedRobot",
    "Misreading",
    "calibrated_temperatures",
    "common_plan",
    "example_robot",
    "held_at",
    "image_provenance",
    "is_station_identified",
    "measured_points",
    "misread_point",
    "other_pose",
    "plan_files",
    "planned_pose",
    "read_plan_for_robot",
    "read_responses",
    "reference_temperature",
    "require_distinct_files",
    "require_temperature",
    "robot_file",
    "robot_provenance",
    "stored_estimates",
    "temperature_remarks",
    "unmeasured_lengths_remark",
    "unmeasured_targets_remark",
    "with_temperature",
]
