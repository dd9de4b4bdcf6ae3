from .accuracy_curve import PoseCurve, pose_curve
from .candidates import random_candidates
from .collision import CollisionChecker
from .criteria import Criterion, DOptimal, Observability, SpectralCriterion, TraceOptimal, observability
from .exchange_algorithm import exchange
from .feasible_poses import PoseCandidates, pose_candidates
from .geometry_sensitivity import (
    BaseSensitivity,
    Tolerances,
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
)
from .next_best import NextPoses, next_poses
from .poses import CriterionName, PoseDesign, choose_poses, design_poses, fewest_poses, random_poses
from .preload import preloaded
from .rank_updates import Selection, greedy
from .sequences import Stage, sequence
from .setup import MeasuringSetup, TrackerNoise
from .skeleton import joint_origins, link_frames
from .trajectories import TrajectoryDesign, design_trajectories
from .visibility import station_position, visible
from .visits import VisitingOrder, visiting_order
from .working_volume import WorkingVolume, working_box, working_points

__all__ = [
    "BaseSensitivity",
    "CollisionChecker",
    "Criterion",
    "CriterionName",
    "DOptimal",
    "MeasuringSetup",
    "NextPoses",
    "Observability",
    "PoseCandidates",
    "PoseCurve",
    "PoseDesign",
    "Selection",
    "SpectralCriterion",
    "Stage",
    "Tolerances",
    "TraceOptimal",
    "TrackerNoise",
    "TrajectoryDesign",
    "VisitingOrder",
    "WorkingVolume",
    "base_sensitivity",
    "choose_poses",
    "design_poses",
    "design_trajectories",
    "exchange",
    "fewest_poses",
    "geometry_jacobian",
    "greedy",
    "joint_origins",
    "link_frames",
    "next_poses",
    "observability",
    "pose_candidates",
    "pose_curve",
    "pose_sensitivity",
    "preloaded",
    "random_candidates",
    "random_poses",
    "sequence",
    "station_position",
    "visible",
    "visiting_order",
    "working_box",
    "working_points",
]
