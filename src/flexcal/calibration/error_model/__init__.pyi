from .error_components import (
    ErrorComponents,
    angular_scatter,
    joint_rotation_jacobian,
    joint_scatter,
    known_scatter,
    translations,
)
from .error_statistics import ErrorStatistics
from .folds import are_different, order_folds, repeated_pose_numbers, workspace_folds
from .groups import SAME_COMMAND, ErrorGroups, block_columns, group_numbers, occurrence
from .point_sums import joint_components
from .variance_components import LARGEST_WAVE, SCATTER_SPREAD, TRANSMISSION, USUAL_SCATTER, LinearFit
from .whitening import Whitening

__all__ = [
    "LARGEST_WAVE",
    "SAME_COMMAND",
    "SCATTER_SPREAD",
    "TRANSMISSION",
    "USUAL_SCATTER",
    "ErrorComponents",
    "ErrorGroups",
    "ErrorStatistics",
    "LinearFit",
    "Whitening",
    "angular_scatter",
    "are_different",
    "block_columns",
    "group_numbers",
    "joint_components",
    "joint_rotation_jacobian",
    "joint_scatter",
    "known_scatter",
    "occurrence",
    "order_folds",
    "repeated_pose_numbers",
    "translations",
    "workspace_folds",
]
