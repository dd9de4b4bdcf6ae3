from .error_components import Scatter, joint_turns, known_scatter, whitened
from .error_statistics import ErrorStatistics
from .folds import are_different, order_folds, single_poses, workspace_folds
from .groups import SAME_COMMAND, ErrorCells, block_columns, distinct, occurrence
from .variance_components import TRANSMISSION, LinearFit

__all__ = [
    "SAME_COMMAND",
    "TRANSMISSION",
    "ErrorCells",
    "ErrorStatistics",
    "LinearFit",
    "Scatter",
    "are_different",
    "block_columns",
    "distinct",
    "joint_turns",
    "known_scatter",
    "occurrence",
    "order_folds",
    "single_poses",
    "whitened",
    "workspace_folds",
]
