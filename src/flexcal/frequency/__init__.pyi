from .averages import Average
from .line_spectra import noise_lines, spectrum
from .local_polynomial import local_polynomial_responses
from .multisine import (
    crest_factor,
    half_integer_frequency,
    leave_out_detection_lines,
    odd_lines,
    optimise_crest,
    orthogonal_matrix,
    reference,
    spectra,
    torque,
)
from .response import FrequencyResponse, frequency_response, frequency_responses
from .symmetry import Reciprocity, reciprocity

__all__ = [
    "Average",
    "FrequencyResponse",
    "Reciprocity",
    "crest_factor",
    "frequency_response",
    "frequency_responses",
    "half_integer_frequency",
    "leave_out_detection_lines",
    "local_polynomial_responses",
    "noise_lines",
    "odd_lines",
    "optimise_crest",
    "orthogonal_matrix",
    "reciprocity",
    "reference",
    "spectra",
    "spectrum",
    "torque",
]
