from .averages import Average
from .line_spectra import noise_lines, spectrum
from .local_polynomial import local_polynomial_responses
from .multisine import (
    crest_factor,
    excitation_torque,
    half_integer_frequency,
    leave_out_detection_lines,
    multisine_spectra,
    odd_lines,
    optimise_crest,
    orthogonal_matrix,
    reference_trajectory,
)
from .response import FrequencyResponse, frequency_response, frequency_responses
from .symmetry import Reciprocity, reciprocity

__all__ = [
    "Average",
    "FrequencyResponse",
    "Reciprocity",
    "crest_factor",
    "excitation_torque",
    "frequency_response",
    "frequency_responses",
    "half_integer_frequency",
    "leave_out_detection_lines",
    "local_polynomial_responses",
    "multisine_spectra",
    "noise_lines",
    "odd_lines",
    "optimise_crest",
    "orthogonal_matrix",
    "reciprocity",
    "reference_trajectory",
    "spectrum",
]
