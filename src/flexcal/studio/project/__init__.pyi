from .choices import Choices
from .folder_lock import sole_studio
from .planned import read_plan_file
from .pose_tables import COMPUTED, is_result, pose_files
from .project import (
    CALIBRATION,
    CHECK_PLAN,
    CHECKED,
    MAP,
    MEASURED,
    PLAN,
    ROBOT,
    VERIFICATION,
    Project,
)

__all__ = [
    "CALIBRATION",
    "CHECKED",
    "CHECK_PLAN",
    "COMPUTED",
    "MAP",
    "MEASURED",
    "PLAN",
    "ROBOT",
    "VERIFICATION",
    "Choices",
    "Project",
    "is_result",
    "pose_files",
    "read_plan_file",
    "sole_studio",
]
