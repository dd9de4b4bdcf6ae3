from .bearing_axes import BearingAxes, compare_bearings
from .coupled_drives import Coupling, undeclared_coupling
from .drift_test import Drift
from .enough_poses import EnoughPoses
from .fleet_conflict import FleetConflict
from .gravity_residuals import GravityLoads, gravity_loads
from .jumps_in_readings import ReadingJump, reading_jumps
from .learning_curve import LearningCurve, LearningPoint
from .nearest_socket import NearestSocket, nearest_sockets
from .noise_test import StatedNoise, stated_noise
from .place_agreement import FEWEST_PLACES, Disagreement, PlaceAgreement, PlaceErrors
from .plausibility import (
    FarZero,
    deviations_from_prior,
    displacements,
    far_zeros,
    implausible_shifts,
    is_implausible,
    residuals_implausible,
)
from .reading_lag import ReadingLag
from .repeatability_floor import RepeatabilityFloor
from .robot_size import RobotSize
from .sensor_lag import SensorLag

__all__ = [
    "FEWEST_PLACES",
    "BearingAxes",
    "Coupling",
    "Disagreement",
    "Drift",
    "EnoughPoses",
    "FarZero",
    "FleetConflict",
    "GravityLoads",
    "LearningCurve",
    "LearningPoint",
    "NearestSocket",
    "PlaceAgreement",
    "PlaceErrors",
    "ReadingJump",
    "ReadingLag",
    "RepeatabilityFloor",
    "RobotSize",
    "SensorLag",
    "StatedNoise",
    "compare_bearings",
    "deviations_from_prior",
    "displacements",
    "far_zeros",
    "gravity_loads",
    "implausible_shifts",
    "is_implausible",
    "nearest_sockets",
    "reading_jumps",
    "residuals_implausible",
    "stated_noise",
    "undeclared_coupling",
]
