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
from flexcal.design.pose_curve import PoseCurve, pose_curve
from flexcal.design.pose_sensitivity import (
    BaseSensitivity,
    Tolerances,
    base_sensitivity,
    geometry_jacobian,
    pose_sensitivity,
)
from flexcal.design.poses import CriterionName, PoseDesign, design_poses, random_poses
from flexcal.design.preload import preloaded
from flexcal.design.setup import Acceptance, MeasuringSetup, TrackerNoise
from flexcal.design.skeleton import joint_origins, link_frames
from flexcal.design.trajectories import design_trajectories
from flexcal.design.visibility import visible
from flexcal.model.joint_space import joint_ranges

__all__ = [
    "Acceptance",
    "BaseSensitivity",
    "CollisionChecker",
    "Criterion",
    "CriterionName",
    "DOptimal",
    "MeasuringSetup",
    "Observability",
    "PoseCurve",
    "PoseDesign",
    "Selection",
    "SpectralCriterion",
    "Tolerances",
    "TraceOptimal",
    "TrackerNoise",
    "base_sensitivity",
    "design_poses",
    "design_trajectories",
    "exchange",
    "geometry_jacobian",
    "greedy",
    "joint_origins",
    "joint_ranges",
    "link_frames",
    "observability",
    "pose_curve",
    "pose_sensitivity",
    "preloaded",
    "random_candidates",
    "random_poses",
    "visible",
]
