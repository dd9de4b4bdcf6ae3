from .amplitude_spectrum import shaped
from .backlash_limit import share_at_rest, within_preload
from .multisines import Schedule, flat_multisine, room
from .payload_placement import Placement, payload_placements
from .pose_selection import ChosenPoses, choose_frequency_poses, stiffness_curve
from .predicted_uncertainty import PlannedResponses
from .response_noise import COMMON_SENSORS, ResponseSensors
from .spring_precision import largest_stiffness_std

__all__ = [
    "COMMON_SENSORS",
    "ChosenPoses",
    "Placement",
    "PlannedResponses",
    "ResponseSensors",
    "Schedule",
    "choose_frequency_poses",
    "flat_multisine",
    "largest_stiffness_std",
    "payload_placements",
    "room",
    "shaped",
    "share_at_rest",
    "stiffness_curve",
    "within_preload",
]
