from .averages import Average
from .covariance import kronecker, pool_noise, vec
from .line_spectra import hold_factor, noise_lines, spectrum, torque_hold
from .local_polynomial import local_polynomial_responses
from .local_windows import ORDER, LocalWindows, projected
from .multisine import (
    crest_factor,
    excitation_torque,
    half_integer_frequency,
    leave_out_detection_lines,
    multisine_spectra,
    odd_lines,
    orthogonal_matrix,
    reference_trajectory,
    samples_per_period,
    synthesise,
)
from .played_signal import (
    PlayedSchedule,
    PlayedSignal,
    envelope,
    multisine_at,
    played_signals,
    reference_motion,
)
from .recognition import MotionSearch, Recognition, SignalSearch, nearest_poses, on_plan
from .response import FrequencyResponse, frequency_responses, pose_response
from .symmetry import reciprocity

__all__ = [
    "ORDER",
    "Average",
    "FrequencyResponse",
    "LocalWindows",
    "MotionSearch",
    "PlayedSchedule",
    "PlayedSignal",
    "Recognition",
    "SignalSearch",
    "crest_factor",
    "envelope",
    "excitation_torque",
    "frequency_responses",
    "half_integer_frequency",
    "hold_factor",
    "kronecker",
    "leave_out_detection_lines",
    "local_polynomial_responses",
    "multisine_at",
    "multisine_spectra",
    "nearest_poses",
    "noise_lines",
    "odd_lines",
    "on_plan",
    "orthogonal_matrix",
    "played_signals",
    "pool_noise",
    "pose_response",
    "projected",
    "reciprocity",
    "reference_motion",
    "reference_trajectory",
    "samples_per_period",
    "spectrum",
    "synthesise",
    "torque_hold",
    "vec",
]
