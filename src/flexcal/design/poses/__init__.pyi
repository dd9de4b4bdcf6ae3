from .accuracy_curve import PoseCurve, pose_curve
from .approaches import blocked_ways, crossed_approaches
from .candidate_blocks import BLOCK, BlockedCandidates, ChosenOfBlock
from .candidates import random_candidates, usable
from .feasibility import PoseCandidates, pose_candidates
from .geometry_sensitivity import (
    GeometricTolerances,
    base_sensitivity,
    geometry_jacobian,
    measuring_noise,
    pose_sensitivity,
)
from .gravity_preload import preloaded
from .ordering import MeasurementOrder, measurement_order
from .poses_with_prior import enough_with_prior
from .selection import (
    CriterionName,
    PoseDesign,
    choose_poses,
    criterion_named,
    fewest_poses,
    random_poses,
    select_poses,
    tool_error,
)
from .sequential_selection import NextPoses, select_next_poses
from .working_volume import WorkingVolume, working_box, working_points
from .zero_accuracy import UNKNOWN_ZERO, zero_stds

__all__ = [
    "BLOCK",
    "UNKNOWN_ZERO",
    "BlockedCandidates",
    "ChosenOfBlock",
    "CriterionName",
    "GeometricTolerances",
    "MeasurementOrder",
    "NextPoses",
    "PoseCandidates",
    "PoseCurve",
    "PoseDesign",
    "WorkingVolume",
    "base_sensitivity",
    "blocked_ways",
    "choose_poses",
    "criterion_named",
    "crossed_approaches",
    "enough_with_prior",
    "fewest_poses",
    "geometry_jacobian",
    "measurement_order",
    "measuring_noise",
    "pose_candidates",
    "pose_curve",
    "pose_sensitivity",
    "preloaded",
    "random_candidates",
    "random_poses",
    "select_next_poses",
    "select_poses",
    "tool_error",
    "usable",
    "working_box",
    "working_points",
    "zero_stds",
]
