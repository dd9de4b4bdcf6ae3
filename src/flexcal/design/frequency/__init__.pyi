from .amplitude_spectrum import optimal_amplitudes
from .backlash_limit import static_amplitude_share, within_preload
from .multisines import Schedule, excitation_margin, flat_multisine
from .payload_placement import Placement, payload_placements
from .pose_selection import FrequencyPoseSelection, choose_frequency_poses, stiffness_curve
from .predicted_uncertainty import PlannedResponses
from .response_noise import COMMON_SENSORS, ResponseSensors
from .signal_limits import PositionLoop, SignalUse, require_within_limits, signal_uses
from .spring_precision import largest_stiffness_std

__all__ = [
    "COMMON_SENSORS",
    "FrequencyPoseSelection",
    "Placement",
    "PlannedResponses",
    "PositionLoop",
    "ResponseSensors",
    "Schedule",
    "SignalUse",
    "choose_frequency_poses",
    "excitation_margin",
    "flat_multisine",
    "largest_stiffness_std",
    "optimal_amplitudes",
    "payload_placements",
    "require_within_limits",
    "signal_uses",
    "static_amplitude_share",
    "stiffness_curve",
    "within_preload",
]
