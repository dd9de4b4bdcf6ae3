from .cell import Cell
from .folder import PLAN, existing_file, labels, write_measured_poses, write_recordings
from .folder_cell import FolderCell

__all__ = [
    "PLAN",
    "Cell",
    "FolderCell",
    "existing_file",
    "labels",
    "write_measured_poses",
    "write_recordings",
]
