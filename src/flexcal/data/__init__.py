"""Recordings, measured poses, plans and estimates: what they are, how they are read and written, where they come from."""

from flexcal.data.cell import Cell
from flexcal.data.experiment_folder import labels, write_measured_poses, write_recordings
from flexcal.data.folder_cell import FolderCell
from flexcal.data.multisine_plan import MultisinePlan
from flexcal.data.plan_files import page_beside, read_plan, read_plan_of, write_plan
from flexcal.data.pose_checks import check_motion
from flexcal.data.pose_files import read_pose_pool, read_poses, write_poses
from flexcal.data.pose_plan import PosePlan
from flexcal.data.pose_pool import PosePool
from flexcal.data.pose_set import PoseSet, concatenate
from flexcal.data.recording import Recording, RecordingLabel
from flexcal.data.recording_files import read_recording, read_recording_blocks, write_recording
from flexcal.data.target_files import read_commands, read_targets, write_commands, write_targets
from flexcal.data.time_base import TimeBase
from flexcal.data.tool_targets import ToolTargets
from flexcal.data.trajectory_paths import FourierPaths, SplinePaths
from flexcal.data.trajectory_plan import TrajectoryPlan
from flexcal.data.working_files import read_working
from flexcal.estimates_file import (
    provenance,
    read_estimates,
    sha256_of,
    write_estimates,
)

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
    "ToolTargets",
    "TrajectoryPlan",
    "check_motion",
    "concatenate",
    "labels",
    "page_beside",
    "provenance",
    "read_commands",
    "read_estimates",
    "read_plan",
    "read_plan_of",
    "read_pose_pool",
    "read_poses",
    "read_recording",
    "read_recording_blocks",
    "read_targets",
    "read_working",
    "sha256_of",
    "write_commands",
    "write_estimates",
    "write_measured_poses",
    "write_plan",
    "write_poses",
    "write_recording",
    "write_recordings",
    "write_targets",
]
