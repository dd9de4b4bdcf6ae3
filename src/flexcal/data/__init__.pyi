from .cell import Cell
from .experiment_folder import labels, write_measured_poses, write_recordings
from .folder_cell import FolderCell
from .multisine_plan import MultisinePlan
from .plan_files import page_beside, read_plan, read_plan_of, write_plan
from .pose_checks import check_motion
from .pose_files import read_pose_pool, read_poses, write_poses
from .pose_plan import PosePlan
from .pose_pool import PosePool
from .pose_set import PoseSet, concatenate
from .recording import Recording, RecordingLabel
from .recording_files import read_recording, read_recording_blocks, write_recording
from .target_files import read_commands, read_targets, write_commands, write_targets
from .time_base import TimeBase
from .time_summary import TimeSummary
from .tool_targets import ToolTargets
from .trajectory_paths import FourierPaths, SplinePaths
from .trajectory_plan import TrajectoryPlan
from .working_files import read_working

__all__ = [
    "Cell",
    "FolderCell",
    "FourierPaths",
    "MultisinePlan",
    "PosePlan",
    "PosePool",
    "PoseSet",
    "Recording",
    "RecordingLabel",
    "SplinePaths",
    "TimeBase",
    "TimeSummary",
    "ToolTargets",
    "TrajectoryPlan",
    "check_motion",
    "concatenate",
    "labels",
    "page_beside",
    "read_commands",
    "read_plan",
    "read_plan_of",
    "read_pose_pool",
    "read_poses",
    "read_recording",
    "read_recording_blocks",
    "read_targets",
    "read_working",
    "write_commands",
    "write_measured_poses",
    "write_plan",
    "write_poses",
    "write_recording",
    "write_recordings",
    "write_targets",
]
