from .choices import Choices
from .folder_lock import sole_studio
from .pose_tables import pose_files
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
    "MAP",
    "MEASURED",
    "PLAN",
    "ROBOT",
    "VERIFICATION",
    "Choices",
    "Project",
    "pose_files",
    "sole_studio",
]
