from .nominal_robot import Registration, distance_to_nominal
from .pose_drift import VISITS_PER_SET, PoseDrift, common_displacement, pose_drifts
from .pose_repeatability import CYCLES, PoseRepeatability, noise_repeatability, visit_statistics
from .source_contributions import error_sources
from .working_volume import PredictedAccuracy, predicted_accuracy, predicted_rms, random_poses_in

__all__ = [
    "CYCLES",
    "VISITS_PER_SET",
    "PoseDrift",
    "PoseRepeatability",
    "PredictedAccuracy",
    "Registration",
    "common_displacement",
    "distance_to_nominal",
    "error_sources",
    "noise_repeatability",
    "pose_drifts",
    "predicted_accuracy",
    "predicted_rms",
    "random_poses_in",
    "visit_statistics",
]
