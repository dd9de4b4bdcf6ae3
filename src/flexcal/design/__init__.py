"""What to measure: the poses that tell most about a robot's geometric errors, under its limits. Needs no data."""

from flexcal.design.candidates import random_candidates
from flexcal.design.collision import CollisionChecker
from flexcal.design.criteria import (
    Criterion,
    DOptimal,
    Observability,
    SpectralCriterion,
    TraceOptimal,
    observability,
)
from flexcal.design.exchange import Selection, exchange, greedy
from flexcal.design.next_poses import NextPoses, next_poses
from flexcal.design.pose_candidates import PoseCandidates, pose_candidates
from flexcal.design.pose_curve import PoseCurve, pose_curve
from flexcal.design.pose_sensitivity import (
    BaseSensitivity,
    Tolerances,
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
)
from flexcal.design.poses import (
    CriterionName,
    PoseDesign,
    choose_poses,
    design_poses,
    fewest_poses,
    random_poses,
)
from flexcal.design.preload import preloaded
from flexcal.design.sequences import Stage, sequence
from flexcal.design.setup import MeasuringSetup, TrackerNoise
from flexcal.design.skeleton import joint_origins, link_frames
from flexcal.design.trajectories import TrajectoryDesign, design_trajectories
from flexcal.design.visibility import station_position, visible
from flexcal.design.visiting_order import VisitingOrder, visiting_order
from flexcal.design.working_volume import WorkingVolume, working_box, working_points
from flexcal.model.joint_space import joint_ranges

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
    "joint_ranges",
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
