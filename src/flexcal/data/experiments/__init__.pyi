from .cell import Cell
from .folder import PLAN, existing_file, labels, write_measured_poses, write_recordings
from .folder_cell import FolderCell, require_measurements, require_same_plan

__all__ = [
    "PLAN",
    "Cell",
    "FolderCell",
    "existing_file",
    "labels",
    "require_measurements",
    "require_same_plan",
    "write_measured_poses",
    "write_recordings",
]
