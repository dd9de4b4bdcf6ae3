from .candidate_pool import PosePool
from .checks import check_metres, check_same_pose
from .columns import check_positive, last_digit, unit_quaternions, whole_numbers
from .excluded_rows import EXCLUDED
from .frame_touches import FrameMethod, FrameTouches
from .image_folders import images_of, tables_of
from .measured_tables import read_grouped_poses, read_pose_pool, read_poses, write_poses
from .pose_set import DEFAULT_SIGMA, DIRECTION, DISTANCE, LINE, PLANE, PoseSet, concatenate, kind_of_face
from .target_files import OF_COMMANDS, read_commands, read_targets, write_commands, write_targets
from .tool_targets import ToolTargets
from .touch_tables import read_frame_touches, read_touches
from .touches import Touches
from .working_files import read_working

__all__ = [
    "DEFAULT_SIGMA",
    "DIRECTION",
    "DISTANCE",
    "EXCLUDED",
    "LINE",
    "OF_COMMANDS",
    "PLANE",
    "FrameMethod",
    "FrameTouches",
    "PosePool",
    "PoseSet",
    "ToolTargets",
    "Touches",
    "check_metres",
    "check_positive",
    "check_same_pose",
    "concatenate",
    "images_of",
    "kind_of_face",
    "last_digit",
    "read_commands",
    "read_frame_touches",
    "read_grouped_poses",
    "read_pose_pool",
    "read_poses",
    "read_targets",
    "read_touches",
    "read_working",
    "tables_of",
    "unit_quaternions",
    "whole_numbers",
    "write_commands",
    "write_poses",
    "write_targets",
]
