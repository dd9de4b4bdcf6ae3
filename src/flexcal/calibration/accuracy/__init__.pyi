from .pose_drift import VISITS_A_SET, PoseDrift, common_way, drift_of_poses
from .pose_repeatability import CYCLES, PoseRepeatability, noise_repeatability, repeatability
from .source_contributions import error_sources
from .working_volume import AccuracyMap, accuracy_map, random_poses_in

__all__ = [
    "CYCLES",
    "VISITS_A_SET",
    "AccuracyMap",
    "PoseDrift",
    "PoseRepeatability",
    "accuracy_map",
    "common_way",
    "drift_of_poses",
    "error_sources",
    "noise_repeatability",
    "random_poses_in",
    "repeatability",
]
