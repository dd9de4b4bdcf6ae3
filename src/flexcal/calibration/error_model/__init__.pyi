from .error_components import Scatter, joint_rotation_jacobian, known_scatter, whitened
from .error_statistics import ErrorStatistics
from .folds import are_different, order_folds, repeated_pose_numbers, workspace_folds
from .groups import SAME_COMMAND, ErrorGroups, block_columns, distinct, occurrence
from .variance_components import TRANSMISSION, LinearFit

__all__ = [
    "SAME_COMMAND",
    "TRANSMISSION",
    "ErrorGroups",
    "ErrorStatistics",
    "LinearFit",
    "Scatter",
    "are_different",
    "block_columns",
    "distinct",
    "joint_rotation_jacobian",
    "known_scatter",
    "occurrence",
    "order_folds",
    "repeated_pose_numbers",
    "whitened",
    "workspace_folds",
]
